// func.cpp -- construction and accessors of Func, and its directives about compute and storage levels.
#include "frontend/language/func.h"

#include "graph/definitions/define.h"
#include "ir/print.h"
#include "ir/visit.h"

namespace retrograde {

namespace {

graph::FuncPtr make_func(const std::string& unique_name, std::source_location where = {}) {
  auto contents = std::make_shared<graph::FuncContents>();
  contents->name = unique_name;
  contents->declared_at = {where.file_name(), static_cast<int>(where.line())};
  return contents;
}

void check_not_extern(const graph::FuncContents& f, const std::string& asked) {
  if (!f.is_extern()) return;
  user_error(asked, "its values are expressions",
             "the C function " + quoted(f.extern_definition->function) + " computes them",
             "Ask is_extern() first");
}

}  // namespace

// ---- construction ----

Func::Func(std::source_location where) : func_(make_func(ir::unique_name("f"), where)) {}

Func::Func(const std::string& name, std::source_location where)
    : func_(make_func(name.empty() ? ir::unique_name("f") : graph::claim_name(name), where)) {}

Func::Func(Type required_type, int required_dimensions, const std::string& name)
    : Func(std::vector<Type>{required_type}, required_dimensions, name) {}

Func::Func(const std::vector<Type>& required_types, int required_dimensions,
           const std::string& name)
    : Func(name) {
  if (required_dimensions < 0) {
    user_error("declare " + quoted(func_->name), "dimensions are not negative",
               text("they are ", required_dimensions), "Give 0 or more");
  }
  func_->required_types = required_types;
  func_->required_dimensions = required_dimensions;
}

Func::Func(const Expr& e) : Func() { (*this)(_) = e; }

// ---- accessors ----

void Func::check_defined(const std::string& asked) const { graph::check_is_defined(*func_, asked); }

std::vector<Var> Func::args() const {
  return std::vector<Var>(func_->args.begin(), func_->args.end());
}

Expr Func::value() const {
  check_defined("take the value of " + quoted(name()));
  check_not_extern(*func_, "take the value of " + quoted(name()));
  if (outputs() != 1) {
    user_error("take the value of " + quoted(name()), "it has one value only if it is no Tuple",
               text("it has ", outputs()), "Use values()");
  }
  return func_->pure->values[0];
}

Tuple Func::values() const {
  check_defined("take the values of " + quoted(name()));
  check_not_extern(*func_, "take the values of " + quoted(name()));
  return Tuple(func_->pure->values);
}

const Type& Func::type() const {
  if (types().empty()) check_defined("take the type of " + quoted(name()));
  return types()[0];
}

std::string Func::source_location() const { return graph::source_location_of(*func_); }

const graph::Definition& Func::checked_update(int index, const char* asked) const {
  if (index >= 0 && index < num_update_definitions()) return func_->updates[index];
  user_error(text(asked, " ", index, " of ", quoted(name())), "updates are numbered from 0",
             text("it has ", num_update_definitions(), " update definitions"), "Name one of them");
}

// The returned Exprs may outlive the Func, so their references to it become strong.
std::vector<Expr> Func::update_args(int index) const {
  return ir::mapped(
      checked_update(index, "take the arguments of update").args,
      [&](const Expr& arg) { return graph::redirect_calls(arg, func_, func_, false); });
}

Expr Func::update_value(int index) const {
  if (outputs() != 1) {
    user_error(text("take the value of update ", index, " of ", quoted(name())),
               "it has one value only if it is no Tuple", text("it has ", outputs()),
               "Use update_values()");
  }
  return update_values(index)[0];
}

Tuple Func::update_values(int index) const {
  return Tuple(ir::mapped(
      checked_update(index, "take the values of update").values,
      [&](const Expr& value) { return graph::redirect_calls(value, func_, func_, false); }));
}

std::vector<RVar> Func::rvars(int index) const {
  const graph::Definition& update = checked_update(index, "take the reduction variables of update");
  std::shared_ptr<graph::ReductionDomainContents> domain;
  walk(update, [&](const ir::Variable& v) {
    if (!domain) domain = graph::domain_of(v);
  });
  const size_t loops = update.rvars.size() - (graph::point_number(update) ? 1 : 0);
  return ir::numbered(loops, [&](size_t i) { return RVar(domain, static_cast<int>(i)); });
}

// ---- running ----

Pipeline& Func::pipeline_to(const char* asked) {
  check_defined(asked + quoted(name()));
  if (!pipeline_.defined()) pipeline_ = Pipeline(*this);
  return pipeline_;
}

std::string Func::loop_nest(const Target& target) {
  return pipeline_to("show the loops of ").loop_nest(target);
}

void Func::print_loop_nest() { pipeline_to("show the loops of ").print_loop_nest(); }

JITHandlers& Func::jit_handlers() {
  return pipeline_to("set what is called back by ").jit_handlers();
}

std::vector<Argument> Func::infer_arguments() const {
  check_defined("list the arguments of " + quoted(name()));
  return Pipeline(*this).infer_arguments();
}

// A Func that was declared with types and dimensions has outputs before it is defined.
void Func::check_has_outputs(const std::string& asked) const {
  if (defined() || func_->required_types.empty()) return check_defined(asked);
  graph::make_outputs(*func_);
}

OutputImageParam Func::output_buffer() const {
  check_has_outputs("use the output buffer of " + quoted(name()));
  if (outputs() != 1) {
    user_error("use the output buffer of " + quoted(name()), "it has one only if it is no Tuple",
               text("it has ", outputs()), "Use output_buffers()");
  }
  return OutputImageParam(func_->outputs[0]);
}

std::vector<OutputImageParam> Func::output_buffers() const {
  check_has_outputs("use the output buffers of " + quoted(name()));
  return ir::mapped(func_->outputs, [&](const auto& output) { return OutputImageParam(output); });
}

// ---- schedule ----

graph::SchedulePlace Func::loops() const {
  check_defined("schedule " + quoted(name()));
  return {func_, 0};
}

Func& Func::reorder_storage(const std::vector<Var>& dims) {
  return give(graph::ReorderStorage{ir::mapped(dims, [&](const Var& dim) { return dim.name(); })});
}

Func& Func::set_estimates(const Region& estimates) {
  frontend::check_estimates(name(), dimensions(), estimates);
  const std::vector<Var> variables = args();
  for (int d = 0; d < dimensions(); d++)
    set_estimate(variables[d], estimates[d].min, estimates[d].extent);
  return *this;
}

Func& Func::ring_buffer(const Expr& copies) { return give(graph::RingBuffer{copies}); }

Stage Func::update(int index) {
  checked_update(index, "schedule update");
  return Stage(func_, index + 1);
}

}  // namespace retrograde
