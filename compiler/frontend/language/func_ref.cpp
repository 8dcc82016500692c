// func_ref.cpp -- definitions and updates by assignment to f(x, y), and reads of it.
#include "frontend/language/func_ref.h"

#include <algorithm>

#include "frontend/language/several_points.h"
#include "frontend/language/var.h"
#include "frontend/run/warnings.h"
#include "graph/definitions/define.h"

namespace retrograde {

namespace {

Expr add(Expr a, Expr b) { return std::move(a) + std::move(b); }
Expr subtract(Expr a, Expr b) { return std::move(a) - std::move(b); }
Expr multiply(Expr a, Expr b) { return std::move(a) * std::move(b); }
Expr divide(Expr a, Expr b) { return std::move(a) / std::move(b); }

void check_one_value(const graph::FuncContents& f) {
  if (f.types.size() == 1) return;
  user_error("use " + quoted(f.name) + "(...) as one expression",
             "a Func of several values is a Tuple at each point",
             text("it has ", f.types.size(), " values"), "Choose one: f(x)[0]");
}

bool is_plain_var(const Expr& e) {
  const ir::Variable* v = e.as<ir::Variable>();
  return v && !v->symbol.defined();
}

}  // namespace

Tuple::Tuple(const std::vector<Expr>& exprs) : exprs_(exprs) {
  if (exprs.empty())
    user_error("make a Tuple", "a Tuple has at least one element", "it was given none",
               "Give it an Expr");
}

Tuple::Tuple(const FuncRef& ref) {
  for (size_t i = 0; i < ref.size(); i++) exprs_.push_back(ref.element(static_cast<int>(i)));
}

void Tuple::check_index(size_t i) const {
  if (i < exprs_.size()) return;
  user_error(text("take element ", i, " of a Tuple"), "elements are numbered from 0",
             text("it has ", exprs_.size(), " elements"), "Give a smaller number");
}

Expr& Tuple::operator[](size_t i) {
  check_index(i);
  return exprs_[i];
}

Expr Tuple::operator[](size_t i) const {
  check_index(i);
  return exprs_[i];
}

// Expands _ on the left-hand side: to the missing dimensions if the number of dimensions is known, and otherwise to
// the implicit variables that the right-hand side uses.
std::vector<Expr> FuncRef::left_args(const std::vector<Expr>& values) const {
  if (frontend::placeholder_position(args_) < 0) return args_;
  const int named_count = static_cast<int>(args_.size()) - 1;
  int count = frontend::implicit_count(values);
  if (func_->is_defined())
    count = func_->dimensions() - named_count;
  else if (func_->required_dimensions >= 0)
    count = func_->required_dimensions - named_count;
  return frontend::expand_placeholder(args_, std::max(count, 0));
}

Stage FuncRef::define(const std::vector<Expr>& values) {
  const std::vector<Expr> args = left_args(values);
  if (frontend::names_several_points(args) || frontend::names_several_points(values)) {
    frontend::define_several_points(func_, args, values);
  } else if (func_->is_defined()) {
    graph::define_update(func_, args, values);
    frontend::warn_of_hidden_definitions(*func_);
  } else {
    graph::define_pure(func_, args, values);
  }
  return Stage(func_, func_->stage_count() - 1);
}

void FuncRef::define_initial(const std::vector<Expr>& args, const std::vector<Expr>& values,
                             int initial) const {
  if (func_->is_defined()) return;
  std::vector<Expr> pure_args;
  std::vector<std::string> seen;
  for (const Expr& arg : args) {
    const bool keep = is_plain_var(arg) && std::find(seen.begin(), seen.end(),
                                                     arg.as<ir::Variable>()->name) == seen.end();
    pure_args.push_back(keep ? arg : Expr(Var()));
    if (keep) seen.push_back(arg.as<ir::Variable>()->name);
  }
  std::vector<Expr> initial_values;
  for (size_t i = 0; i < values.size(); i++) {
    if (!values[i].defined()) {
      user_error("update " + quoted(func_->name),
                 "the right-hand side must be a defined expression", "it was never assigned",
                 "Assign every Expr before it is used");
    }
    const Type type =
        func_->required_types.size() == values.size() ? func_->required_types[i] : values[i].type();
    initial_values.push_back(ir::make_const(type, initial));
  }
  graph::define_pure(func_, pure_args, initial_values);
}

Stage FuncRef::update(const std::vector<Expr>& values, int initial, Combine combine) {
  FuncRef here(func_, left_args(values));
  define_initial(here.args_, values, initial);
  if (values.size() != func_->types.size()) {
    user_error("update " + quoted(func_->name),
               "all definitions of a Func have the same number of values",
               text("it has ", func_->types.size(), " and the right-hand side ", values.size()),
               "Give the same number of values");
  }
  return here.define(ir::numbered(values.size(), [&](size_t i) {
    return combine(here.element(static_cast<int>(i)), values[i]);
  }));
}

Stage FuncRef::operator=(const Expr& value) { return define({value}); }
Stage FuncRef::operator=(const Tuple& values) { return define(values.as_vector()); }
// NOLINTNEXTLINE(bugprone-unhandled-self-assignment): a definition, not an assignment
Stage FuncRef::operator=(const FuncRef& value) { return define(Tuple(value).as_vector()); }

#define RETROGRADE_DEFINE_UPDATE(op, initial, combine)                                            \
  Stage FuncRef::operator op(Expr value) { return update({std::move(value)}, initial, combine); } \
  Stage FuncRef::operator op(const Tuple& values) {                                               \
    return update(values.as_vector(), initial, combine);                                          \
  }                                                                                               \
  Stage FuncRef::operator op(const FuncRef& value) {                                              \
    return update(Tuple(value).as_vector(), initial, combine);                                    \
  }
RETROGRADE_DEFINE_UPDATE(+=, 0, add)
RETROGRADE_DEFINE_UPDATE(-=, 0, subtract)
RETROGRADE_DEFINE_UPDATE(*=, 1, multiply)
RETROGRADE_DEFINE_UPDATE(/=, 1, divide)
#undef RETROGRADE_DEFINE_UPDATE

Expr FuncRef::element(int i) const {
  if (!func_->is_defined()) {
    user_error("read " + quoted(func_->name), "a Func is defined before it is read",
               "it has no definition",
               "Define it first: f(x, y) = ...; a recurrence starts from a first definition and "
               "runs over an RDom");
  }
  if (i < 0 || i >= static_cast<int>(func_->types.size())) {
    user_error(text("read value ", i, " of ", quoted(func_->name)),
               "the values of a point are numbered from 0",
               text("it has ", func_->types.size(), " values at each point"),
               "Give a number below that");
  }
  std::vector<Expr> at =
      frontend::access_coordinates(args_, func_->dimensions(), "the Func " + quoted(func_->name));
  return ir::call_func(func_->name, func_->types[i], std::move(at), i, ir::SymbolRef(func_));
}

FuncRef::operator Expr() const {
  if (func_->is_defined()) check_one_value(*func_);
  return element(0);
}

FuncTupleElementRef FuncRef::operator[](int i) const { return FuncTupleElementRef(*this, i); }

size_t FuncRef::size() const {
  if (!func_->is_defined()) element(0);  // the error for undefined Funcs
  return func_->types.size();
}

FuncTupleElementRef::FuncTupleElementRef(FuncRef ref, int index) : ref_(ref), index_(index) {
  ref_.element(index);  // checks that the Func is defined and has this value
}

// The update stores all values of the point; the others are stored back unchanged.
Stage FuncTupleElementRef::operator=(const Expr& value) {
  FuncRef here(ref_.func_, ref_.left_args({value}));
  return here.define(ir::numbered(here.size(), [&](size_t i) {
    return static_cast<int>(i) == index_ ? value : here.element(static_cast<int>(i));
  }));
}

}  // namespace retrograde
