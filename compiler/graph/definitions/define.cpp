// define.cpp -- the rules for definitions.
//
// Checks of every definition, in this order: number of arguments, defined expressions, types, free
// variables. For pure definitions, the arguments must be distinct Vars. For updates, all reduction
// variables must come from one domain, the Func must not be frozen, and a pure variable must keep
// its position in every reference of the Func to itself.
#include "graph/definitions/define.h"

#include <algorithm>
#include <unordered_set>

#include "diagnostics/error.h"
#include "graph/definitions/own_reads.h"
#include "graph/definitions/random_sequence.h"
#include "graph/directives/directive.h"
#include "graph/names.h"
#include "ir/build.h"
#include "ir/literal.h"
#include "ir/overflow.h"
#include "ir/print.h"
#include "ir/visit.h"

namespace retrograde::graph {

namespace {

std::string list(const std::vector<Expr>& exprs) {
  return "(" + listed(exprs, [](const Expr& e) { return text(e); }) + ")";
}

// The definition in question as messages show it: "define "f"(x, r.x)".
struct Site {
  const FuncContents& f;
  std::string asked;
};

Site site_of(const FuncContents& f, const std::vector<Expr>& args, bool is_update) {
  for (const Expr& arg : args) {
    if (arg.defined()) continue;
    user_error("define " + quoted(f.name),
               "every argument on the left-hand side must be a defined expression",
               "one of them was never assigned", "Assign every Expr before it is used");
  }
  return {f, text(is_update ? "update " : "define ", quoted(f.name), list(args))};
}

void check_values(const Site& site, const std::vector<Expr>& values) {
  if (values.empty())
    user_error(site.asked, "a definition has at least one value", "the Tuple is empty",
               "Give it an Expr");
  for (size_t i = 0; i < values.size(); i++) {
    if (!values[i].defined()) {
      user_error(site.asked, "the right-hand side must be a defined expression",
                 values.size() == 1 ? "it was never assigned"
                                    : text("element ", i, " of the Tuple was never assigned"),
                 "Assign every Expr before it is used");
    }
  }
}

bool mentions_undef(const Expr& root) {
  return any_node(root, [](const Expr& e) { return is_undef(e); });
}

// An undef value means that nothing is stored; an undef coordinate has no meaning. `exprs`: all
// expressions of both sides.
void check_coordinates(const Site& site, const std::vector<Expr>& args,
                       const std::vector<Expr>& exprs) {
  const auto refuse = [&](const Expr& coordinate, const std::string& where) {
    user_error(site.asked, "a coordinate has a value, and undef has none",
               text("the coordinate ", coordinate, " ", where, " comes from undef"),
               "Give the place a value, and store undef there to leave it as it is");
  };
  for (const Expr& arg : args)
    if (mentions_undef(arg)) refuse(arg, "on the left-hand side");
  for (const Expr& root : exprs) {
    if (!mentions_undef(root)) continue;
    walk(root, [&](const Call& call) {
      if (call.call_type != CallType::Func && call.call_type != CallType::Image) return;
      for (const Expr& arg : call.args)
        if (mentions_undef(arg)) refuse(arg, "of " + quoted(call.name));
    });
  }
}

// `exprs`: all expressions of both sides, as the user wrote them.
void check_constants(const Site& site, const std::vector<Expr>& exprs) {
  for (const Expr& root : exprs) {
    const Expr part = overflowing_part(root);
    if (!part.defined()) continue;
    user_error(site.asked, "constants of int32 and int64 do not overflow",
               text(part, " does not fit ", to_string(part.type())),
               "Cast an operand to a wider type, or to an unsigned one, which wraps around");
  }
}

void check_types(const Site& site, const std::vector<Expr>& values, const std::vector<Type>& types,
                 const char* whose) {
  if (values.size() != types.size()) {
    user_error(site.asked, "all definitions of a Func have the same number of values",
               text(whose, " has ", types.size(), " and this one has ", values.size()),
               "Give the same number of values");
  }
  for (size_t i = 0; i < types.size(); i++) {
    if (values[i].type() == types[i]) continue;
    user_error(site.asked, "all definitions of a Func have the same types",
               text(whose, values.size() > 1 ? text(" for element ", i) : std::string(), " gives ",
                    to_string(types[i]), " and this one ", to_string(values[i].type())),
               text("Convert the right-hand side: cast(", to_string(types[i]), ", ...)"));
  }
}

// The names in a definition: each free variable once, without names bound by lets.
struct Names {
  std::vector<const Variable*> free;
  std::vector<const Call*> self_calls;
  std::vector<FuncPtr> callees;
};

Names names_in(const FuncContents& f, const std::vector<Expr>& roots) {
  Names names;
  std::unordered_set<const ExprNode*> seen;
  std::unordered_set<std::string> bound;
  std::unordered_set<const Symbol*> called;
  for (const Expr& root : roots) {
    if (!root.defined()) continue;
    walk(root, [&](const Expr& e) {
      if (!seen.insert(e.get()).second) return false;
      if (const Variable* v = e.as<Variable>()) names.free.push_back(v);
      if (const Let* let = e.as<Let>()) bound.insert(let->name);
      const Call* call = e.as<Call>();
      if (call && call->call_type == CallType::Func) {
        if (call->symbol.raw() == &f) {
          names.self_calls.push_back(call);
        } else if (called.insert(call->symbol.raw()).second) {
          names.callees.push_back(func_of(*call));
        }
      }
      return true;
    });
  }
  std::erase_if(names.free, [&](const Variable* v) { return bound.count(v->name) != 0; });
  return names;
}

// A plain Var, as opposed to a parameter or reduction variable, which carry a symbol.
const Variable* as_plain_var(const Expr& e) {
  const Variable* v = e.as<Variable>();
  return v && !v->symbol.defined() && v->type == Int(32) ? v : nullptr;
}

// The reduction domain of a definition, null when it has none. `result`: the domain, if already
// known.
DomainPtr domain_in(const Site& site, const Names& names, DomainPtr result = nullptr) {
  for (const Variable* v : names.free) {
    auto domain = domain_of(*v);
    if (!domain) continue;
    if (result && domain != result) {
      user_error(
          site.asked, "all reduction variables of one definition come from one RDom",
          text(quoted(v->name), " and ", quoted(result->vars[0].var), " are of different RDoms"),
          "Make one RDom with all of the variables");
    }
    result = domain;
  }
  return result;
}

void check_free_variables(const Site& site, const Names& names,
                          const std::vector<std::string>& args) {
  for (const Variable* v : names.free) {
    const bool is_arg = std::ranges::find(args, v->name) != args.end();
    if (v->symbol.defined()) {
      if (is_arg && !domain_of(*v)) {
        user_error(site.asked,
                   "a parameter and a pure variable of one definition have different names",
                   "both are called " + quoted(v->name), "Rename the Var or the Param");
      }
      continue;
    }
    if (is_arg) continue;
    if (implicit_index(v->name) >= 0 || is_placeholder(v->name)) {
      user_error(site.asked, "a right-hand side that uses _ needs _ on the left-hand side",
                 text("it uses ", quoted(v->name)),
                 text("Write ", quoted(site.f.name), "(..., _) = ..."));
    }
    user_error(site.asked,
               "every variable on the right-hand side appears on the left-hand side, or belongs to "
               "an RDom",
               text(quoted(v->name), " appears only on the right-hand side"),
               "Add it as an argument, or reduce over an RDom");
  }
}

void freeze(const Names& names) {
  for (const FuncPtr& callee : names.callees) callee->frozen = true;
}

// A random number depends on the Func, the stage and the point where it is evaluated.
Expr bind_random(const Expr& e, const std::vector<Expr>& point) {
  return rewrite(e, [&](const Expr& part, const auto& recurse) -> Expr {
    const Call* call = as_op(part, Op::random);
    if (!call || call->args.size() != 1) return {};
    std::vector<Expr> words{recurse(call->args[0])};
    append(words, point);
    return call_op(Op::random, call->type, std::move(words));
  });
}

bool has_random(const std::vector<Expr>& values) {
  const auto is_random = [](const Call& call) { return call.is_op(Op::random); };
  return std::ranges::any_of(values, [&](const Expr& value) { return any_node(value, is_random); });
}

std::vector<Expr> bind_all_random(const FuncContents& f, int stage,
                                  const std::vector<std::string>& variables,
                                  std::vector<Expr> values) {
  if (!has_random(values)) return values;
  std::vector<Expr> point{Expr(static_cast<int32_t>(static_cast<uint32_t>(random_tag(f.name)) +
                                                    static_cast<uint32_t>(stage)))};
  for (const std::string& name : variables) point.push_back(variable(name));
  for (Expr& value : values) value = bind_random(value, point);
  return values;
}

std::vector<std::string> pure_names(const Site& site, const std::vector<Expr>& args) {
  std::vector<std::string> names;
  for (const Expr& arg : args) {
    const Variable* v = as_plain_var(arg);
    if (!v) {
      user_error(site.asked, "the arguments of a first definition are Vars",
                 text(arg, " is not a Var"),
                 "Define all points first, as in f(x) = 0, then update some of them");
    }
    if (std::ranges::find(names, v->name) != names.end()) {
      user_error(site.asked, "the arguments of a first definition are different Vars",
                 quoted(v->name) + " appears twice", "Use a Var of its own for each dimension");
    }
    names.push_back(v->name);
  }
  return names;
}

void check_declared(const Site& site, size_t dimensions, const std::vector<Expr>& values) {
  const FuncContents& f = site.f;
  if (f.required_dimensions >= 0 && static_cast<int>(dimensions) != f.required_dimensions) {
    user_error(site.asked, "a definition has the dimensions that the Func was declared with",
               text("it was declared with ", f.required_dimensions, " and is given ", dimensions),
               "Give that many arguments");
  }
  if (!f.required_types.empty()) check_types(site, values, f.required_types, "the declaration");
}

std::vector<Expr> with(std::vector<Expr> all, const std::vector<Expr>& more) {
  append(all, more);
  return all;
}

void check_update_arity(const Site& site, const std::vector<Expr>& args) {
  if (args.size() == site.f.args.size()) return;
  user_error(site.asked, "all definitions of a Func have the same number of arguments",
             text("its first definition has ", site.f.args.size(), " and this one ", args.size()),
             "Give the same number of arguments");
}

// The coordinates of the left-hand side as int32.
std::vector<Expr> update_coordinates(const Site& site, const std::vector<Expr>& args) {
  std::vector<Expr> result;
  for (const Expr& arg : args) {
    if (!arg.type().is_int_or_uint() || !arg.type().is_scalar()) {
      user_error(site.asked, "coordinates are integers",
                 text(arg, " has type ", to_string(arg.type())), "Convert it: cast<int>(...)");
    }
    result.push_back(int32_literal(arg, site.asked));
  }
  return result;
}

// Dimensions in which the left-hand side is the pure variable itself; their iterations are
// independent.
std::vector<std::string> pure_positions(const FuncContents& f, const std::vector<Expr>& args) {
  std::vector<std::string> result(args.size());
  for (size_t i = 0; i < args.size(); i++) {
    const Variable* v = as_plain_var(args[i]);
    if (v && v->name == f.args[i]) result[i] = v->name;
  }
  return result;
}

void check_self_calls(const Site& site, const Names& names, const std::vector<std::string>& pure) {
  for (const Call* call : names.self_calls) {
    for (size_t i = 0; i < pure.size(); i++) {
      if (pure[i].empty()) continue;
      const Variable* v = call->args[i].as<Variable>();
      if (v && v->name == pure[i]) continue;
      user_error(site.asked,
                 "a pure variable keeps its position in every reference of a Func to itself, "
                 "so that its "
                 "iterations are independent",
                 text("the right-hand side reads ", quoted(site.f.name), list(call->args),
                      ", where argument ", i, " is not ", quoted(pure[i])),
                 "Use an RDom for the dimension that the recurrence runs along");
    }
  }
}

// The domain in a form that an update of f may own. If its predicate reads f, ownership would be
// cyclic and leak both; such a domain is copied with weak references to f.
DomainPtr domain_for(const FuncPtr& f, const DomainPtr& domain) {
  if (!domain->predicate.defined()) return domain;
  const Expr released = redirect_calls(domain->predicate, f, f, true);
  if (released.same_as(domain->predicate)) return domain;
  const auto copy = std::make_shared<ReductionDomainContents>(*domain);
  copy->predicate = rebind_symbol(released, domain.get(), SymbolRef::weak(copy));
  return copy;
}

void check_bounds(const Site& site, const FuncPtr& f, const ReductionDomainContents& domain) {
  for (const ReductionVariable& v : domain.vars) {
    for (const Expr& bound : {v.min, v.extent}) {
      if (redirect_calls(bound, f, f, true).same_as(bound)) continue;
      user_error(site.asked, "the bounds of a reduction domain are known before its update runs",
                 text("the domain of ", quoted(v.var), " has the bound ", bound, ", which reads ",
                      quoted(f->name), " itself"),
                 text("Compute the bound in another Func, or give the domain a constant bound and "
                      "say with RDom::where which points count"));
    }
  }
}

Definition make_update(const FuncPtr& f, std::vector<Expr> args, std::vector<Expr> values,
                       const DomainPtr& declared) {
  Definition update;
  update.args = std::move(args);
  update.values = std::move(values);
  DomainPtr domain = declared;
  if (declared) {
    declared->frozen = true;
    domain = domain_for(f, declared);
    update.rvars = domain->vars;
    if (domain->predicate.defined())
      update.predicate = rebind_symbol(domain->predicate, SymbolRef(domain));
  }
  return map_exprs(update, [&](const Expr& e) {
    const Expr own = redirect_calls(e, f, f, true);
    return domain == declared ? own : rebind_symbol(own, declared.get(), SymbolRef(domain));
  });
}

}  // namespace

void make_outputs(FuncContents& f) {
  if (!f.outputs.empty()) return;
  const std::vector<Type>& types = f.types.empty() ? f.required_types : f.types;
  const int dimensions = f.types.empty() ? f.required_dimensions : f.dimensions();
  for (size_t i = 0; i < types.size(); i++) {
    auto output = std::make_shared<ParameterContents>();
    output->name = types.size() == 1 ? f.name : f.name + "." + std::to_string(i);
    output->type = types[i];
    output->is_buffer = true;
    output->dimensions = dimensions;
    output->constraints.resize(static_cast<size_t>(dimensions));
    f.outputs.push_back(std::move(output));
  }
}

namespace {

// Why an expression has no single value in a call; empty when it has one.
std::string varying_part(const Expr& root) {
  std::string part;
  walk(root, [&](const Expr& e) {
    if (!part.empty()) return false;
    if (const Variable* v = e.as<Variable>()) {
      if (!std::dynamic_pointer_cast<ParameterContents>(v->symbol.lock()))
        part = text(quoted(v->name), " is a variable of loops");
    }
    if (const Call* call = e.as<Call>()) {
      if (call->call_type == CallType::Func)
        part = text(e, " is a value of the Func ", quoted(call->name));
      if (call->call_type == CallType::Image)
        part = text(e, " is an element of the image ", quoted(call->name));
      if (call->is_op(Op::random)) part = text(e, " is random");
    }
    return part.empty();
  });
  return part;
}

}  // namespace

void check_over_parameters(const Expr& e, const char* what, const std::string& asked) {
  const std::string part = varying_part(e);
  if (part.empty()) return;
  user_error(asked,
             text(what,
                  " has one value in each call: it is made of parameters and facts "
                  "about buffers"),
             part, "Use a Param, or a fact such as in.dim(0).extent()");
}

std::string source_location_of(const FuncContents& f) {
  return f.declared_at.file.empty() ? "" : text(f.declared_at.file, ":", f.declared_at.line);
}

std::string stage_name(const FuncContents& f, int stage) {
  return stage == 0 ? f.name : text(f.name, ".update(", stage - 1, ")");
}

Expr redirect_calls(const Expr& e, const FuncPtr& from, const FuncPtr& to, bool weak) {
  return map_calls_of(e, from.get(), [&](const Call& call, const std::vector<Expr>& args) {
    SymbolRef symbol = weak ? SymbolRef::weak(to) : SymbolRef(to);
    return call_func(to->name, call.type, args, call.component, std::move(symbol));
  });
}

void define_pure(const FuncPtr& f, const std::vector<Expr>& args, const std::vector<Expr>& raw) {
  const Site site = site_of(*f, args, false);
  if (f->is_defined())
    user_error(site.asked, "a Func is defined once", "it has a definition already", "Update it");
  check_values(site, raw);
  check_constants(site, raw);
  const std::vector<std::string> variables = pure_names(site, args);
  check_declared(site, args.size(), raw);
  if (auto domain = domain_in(site, names_in(*f, raw))) {
    user_error(site.asked, "a first definition has no reduction variables",
               text("it uses ", quoted(domain->vars[0].var)),
               "Reduce in an update, f(x) += ..., or inside the expression with sum(...)");
  }
  const std::vector<Expr> values = settled(raw);
  check_coordinates(site, {}, values);
  const Names names = names_in(*f, values);
  check_free_variables(site, names, variables);

  freeze(names);
  f->args = variables;
  for (const Expr& value : values) f->types.push_back(value.type());
  Definition pure;
  pure.args = variables_of(variables);
  pure.values = bind_all_random(*f, 0, variables, values);
  f->pure = std::move(pure);
  f->pure->schedule.dims = first_loops(*f, *f->pure);
  f->schedule.storage_dims = variables;
  make_outputs(*f);
  f->version++;
}

// The domain comes from the expressions as written; all other checks apply to the folded
// expressions.
void define_update(const FuncPtr& f, const std::vector<Expr>& raw_args,
                   const std::vector<Expr>& raw_values, const DomainPtr& declared) {
  const Site site = site_of(*f, raw_args, true);
  if (!f->is_defined())
    user_error(site.asked, "a Func is updated after its first definition", "it has none",
               "Define it first: f(x) = 0");
  if (f->is_extern()) {
    user_error(site.asked, "a Func that a C function computes has no updates",
               text("it is defined by ", quoted(f->extern_definition->function)),
               "Update a Func that reads it");
  }
  if (f->frozen) {
    user_error(site.asked, "a Func is complete when another Func uses it",
               "another Func uses it already",
               "Move the update before that use, or put it into a new Func");
  }
  check_update_arity(site, raw_args);
  check_values(site, raw_values);
  check_constants(site, with(raw_args, raw_values));
  check_types(site, raw_values, f->types, "the first definition");
  const auto domain = domain_in(site, names_in(*f, with(raw_args, raw_values)), declared);
  std::vector<Expr> exprs = settled(with(update_coordinates(site, raw_args), raw_values));
  const auto first_value = exprs.begin() + static_cast<std::ptrdiff_t>(raw_args.size());
  const std::vector<Expr> args(exprs.begin(), first_value), values(first_value, exprs.end());
  if (domain && domain->predicate.defined()) exprs.push_back(domain->predicate);
  check_coordinates(site, args, exprs);
  const Names names = names_in(*f, exprs);
  domain_in(site, names, domain);  // the predicate may mention another domain
  if (domain) check_bounds(site, f, *domain);
  const std::vector<std::string> pure = pure_positions(*f, args);
  check_free_variables(site, names, pure);
  check_self_calls(site, names, pure);

  freeze(names);
  auto variables = filtered(pure, [&](const std::string& name) { return !name.empty(); });
  if (domain) {
    for (const ReductionVariable& rvar : domain->vars) variables.push_back(rvar.var);
  }
  const int stage = f->stage_count();
  Definition update = make_update(f, args, bind_all_random(*f, stage, variables, values), domain);
  update.schedule.dims = first_loops(*f, update);
  f->updates.push_back(std::move(update));
  f->version++;
}

}  // namespace retrograde::graph
