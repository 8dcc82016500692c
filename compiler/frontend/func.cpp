// func.cpp -- the handle of a Func: accessors, and the directives about where it is computed and
// stored.
#include "frontend/func.h"

#include <algorithm>

#include "frontend/define.h"
#include "ir/print.h"
#include "ir/visit.h"

namespace retrograde {

namespace {

ir::FuncPtr make_func(const std::string& unique_name) {
  auto contents = std::make_shared<ir::FuncContents>();
  contents->name = unique_name;
  return contents;
}

}  // namespace

// ---- loop levels ----

LoopLevel::LoopLevel(const Func& f, const VarOrRVar& var, int stage_index) {
  // Outside of all loops of f. Computing it at root gives the same values and is always legal;
  // storage lives longer only where f itself is computed inside another Func.
  if (var.name() == Var::outermost().name()) {
    level_.kind = ir::LoopLevel::Kind::Root;
    return;
  }
  level_.kind = ir::LoopLevel::Kind::At;
  level_.func = f.name();
  level_.var = var.name();
  level_.stage = stage_index;
}

LoopLevel LoopLevel::root() {
  LoopLevel result;
  result.level_.kind = ir::LoopLevel::Kind::Root;
  return result;
}

std::string LoopLevel::to_string() const {
  switch (level_.kind) {
    case ir::LoopLevel::Kind::Inlined:
      return "inlined";
    case ir::LoopLevel::Kind::Root:
      return "root";
    case ir::LoopLevel::Kind::At:
      return level_.func + "." + level_.var;
  }
  internal_error("a loop level of unknown kind");
}

// ---- construction ----

Func::Func() : func_(make_func(ir::unique_name("f"))) {}

Func::Func(const std::string& name)
    : func_(make_func(name.empty() ? ir::unique_name("f") : ir::claim_name(name))) {}

Func::Func(Type required_type, int required_dimensions, const std::string& name)
    : Func(std::vector<Type>{required_type}, required_dimensions, name) {}

Func::Func(const std::vector<Type>& required_types, int required_dimensions,
           const std::string& name)
    : Func(name) {
  func_->required_types = required_types;
  func_->required_dimensions = required_dimensions;
}

Func::Func(const Expr& e) : Func() { (*this)(_) = e; }

// ---- accessors ----

void Func::check_defined(const std::string& asked) const {
  if (defined()) return;
  user_error(asked, quoted(name()) + " needs a definition first", "it has none",
             "Define it: f(x, y) = ...");
}

std::vector<Var> Func::args() const {
  return std::vector<Var>(func_->args.begin(), func_->args.end());
}

Expr Func::value() const {
  check_defined("take the value of " + quoted(name()));
  if (outputs() != 1) {
    user_error("take the value of " + quoted(name()), "it has one value only if it is no Tuple",
               text("it has ", outputs()), "Use values()");
  }
  return func_->pure->values[0];
}

Tuple Func::values() const {
  check_defined("take the values of " + quoted(name()));
  return Tuple(func_->pure->values);
}

const Type& Func::type() const {
  check_defined("take the type of " + quoted(name()));
  return func_->types[0];
}

const ir::Definition& Func::checked_update(int index, const char* asked) const {
  if (index >= 0 && index < num_update_definitions()) return func_->updates[index];
  user_error(text(asked, " ", index, " of ", quoted(name())), "updates are numbered from 0",
             text("it has ", num_update_definitions(), " update definitions"));
}

// What leaves the Func may outlive it: references to it are strong again.
std::vector<Expr> Func::update_args(int index) const {
  std::vector<Expr> result;
  for (const Expr& arg : checked_update(index, "take the arguments of update").args) {
    result.push_back(ir::redirect_calls(arg, func_, func_, false));
  }
  return result;
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
  std::vector<Expr> result;
  for (const Expr& value : checked_update(index, "take the values of update").values) {
    result.push_back(ir::redirect_calls(value, func_, func_, false));
  }
  return Tuple(result);
}

std::vector<RVar> Func::rvars(int index) const {
  const ir::Definition& update = checked_update(index, "take the reduction variables of update");
  std::shared_ptr<ir::ReductionDomainContents> domain;
  ir::for_each_expr(update, [&](const Expr& root) {
    ir::walk(root, [&](const Expr& e) {
      const ir::Variable* v = e.as<ir::Variable>();
      if (v && !domain) domain = ir::domain_of(*v);
      return !domain;
    });
  });
  std::vector<RVar> result;
  for (size_t i = 0; i < update.rvars.size(); i++)
    result.push_back(RVar(domain, static_cast<int>(i)));
  return result;
}

// ---- running it ----

Pipeline& Func::pipeline() {
  if (!pipeline_.defined()) pipeline_ = Pipeline(*this);
  return pipeline_;
}

Realization Func::realize(const std::vector<int32_t>& sizes, const Target& target) {
  check_defined("realize " + quoted(name()));
  return pipeline().realize(sizes, target);
}

void Func::realize(Pipeline::RealizationArg outputs, const Target& target) {
  check_defined("realize " + quoted(name()));
  pipeline().realize(std::move(outputs), target);
}

void Func::infer_input_bounds(const std::vector<int32_t>& sizes, const Target& target) {
  check_defined("infer the input bounds of " + quoted(name()));
  pipeline().infer_input_bounds(sizes, target);
}

void Func::infer_input_bounds(Pipeline::RealizationArg outputs, const Target& target) {
  check_defined("infer the input bounds of " + quoted(name()));
  pipeline().infer_input_bounds(std::move(outputs), target);
}

void Func::compile_jit(const Target& target) {
  check_defined("compile " + quoted(name()));
  pipeline().compile_jit(target);
}

std::string Func::loop_nest(const Target& target) {
  check_defined("show the loops of " + quoted(name()));
  return pipeline().loop_nest(target);
}

void Func::print_loop_nest() {
  check_defined("show the loops of " + quoted(name()));
  pipeline().print_loop_nest();
}

std::vector<Argument> Func::infer_arguments() const {
  check_defined("list the arguments of " + quoted(name()));
  return Pipeline(*this).infer_arguments();
}

JITHandlers& Func::jit_handlers() { return pipeline().jit_handlers(); }

void Func::set_custom_print(void (*handler)(void*, const char*)) {
  jit_handlers().print = [handler](const char* message) { handler(nullptr, message); };
}

OutputImageParam Func::output_buffer() const {
  check_defined("use the output buffer of " + quoted(name()));
  if (outputs() != 1) {
    user_error("use the output buffer of " + quoted(name()), "it has one only if it is no Tuple",
               text("it has ", outputs()), "Use output_buffers()");
  }
  return OutputImageParam(func_->outputs[0]);
}

std::vector<OutputImageParam> Func::output_buffers() const {
  check_defined("use the output buffers of " + quoted(name()));
  std::vector<OutputImageParam> result;
  for (const auto& output : func_->outputs) result.push_back(OutputImageParam(output));
  return result;
}

// ---- schedule ----

Stage Func::pure_stage() const {
  check_defined("schedule " + quoted(name()));
  return Stage(func_, 0);
}

Stage Func::update(int index) {
  checked_update(index, "schedule update");
  return Stage(func_, index + 1);
}

ir::FuncSchedule& Func::touch() {
  func_->version++;
  func_->schedule.touched = true;
  return func_->schedule;
}

Func& Func::compute_inline() { return compute_at(LoopLevel::inlined()); }
Func& Func::compute_root() { return compute_at(LoopLevel::root()); }
Func& Func::store_root() { return store_at(LoopLevel::root()); }

// Storing follows computing, unless it was asked for elsewhere.
Func& Func::compute_at(const LoopLevel& level) {
  ir::FuncSchedule& schedule = touch();
  const auto same = [](const ir::LoopLevel& a, const ir::LoopLevel& b) {
    return a.kind == b.kind && a.func == b.func && a.var == b.var && a.stage == b.stage;
  };
  const bool follows = schedule.store_level.kind == ir::LoopLevel::Kind::Inlined ||
                       same(schedule.store_level, schedule.compute_level);
  schedule.compute_level = level.contents();
  if (follows) schedule.store_level = level.contents();
  return *this;
}

Func& Func::store_at(const LoopLevel& level) {
  touch().store_level = level.contents();
  return *this;
}

Func& Func::store_in(MemoryType memory) {
  touch().memory = memory;
  return *this;
}

Func& Func::reorder_storage(const std::vector<Var>& dims) {
  check_defined("reorder the storage of " + quoted(name()));
  const std::string asked = "reorder the storage of " + quoted(name());
  std::vector<std::string>& storage = touch().storage_dims;
  std::vector<size_t> places;
  for (const Var& dim : dims) {
    const auto it = std::find(storage.begin(), storage.end(), dim.name());
    if (it == storage.end())
      user_error(asked, quoted(dim.name()) + " must be one of its dimensions", "it is not");
    const size_t place = static_cast<size_t>(it - storage.begin());
    if (std::find(places.begin(), places.end(), place) != places.end()) {
      user_error(asked, "each dimension is named once", quoted(dim.name()) + " is named twice");
    }
    places.push_back(place);
  }
  std::sort(places.begin(), places.end());
  for (size_t i = 0; i < dims.size(); i++) storage[places[i]] = dims[i].name();
  return *this;
}

void Func::add_bound(std::vector<ir::Bound>& bounds, const std::string& asked, const Var& var,
                     Expr min, Expr extent) {
  check_defined(asked);
  if (std::find(func_->args.begin(), func_->args.end(), var.name()) == func_->args.end()) {
    std::string args;
    for (const std::string& arg : func_->args) args += (args.empty() ? "" : ", ") + quoted(arg);
    user_error(asked, quoted(var.name()) + " must be a pure variable of the first definition",
               args.empty() ? "it has no dimensions" : "its variables are " + args,
               "Name one of them");
  }
  if (!extent.defined()) user_error(asked, "the extent must be a defined expression");
  for (Expr* e : {&min, &extent}) {
    if (!e->defined()) continue;
    if (!e->type().is_int_or_uint() || !e->type().is_scalar()) {
      user_error(asked, "bounds are integers", text(*e, " has type ", to_string(e->type())));
    }
    *e = ir::cast_to(Int(32), *e);
  }
  auto constant = ir::as_const_int(extent);
  if (constant && *constant < 0)
    user_error(asked, "an extent is not negative", text("it is ", *constant));
  std::erase_if(bounds, [&](const ir::Bound& bound) { return bound.var == var.name(); });
  bounds.push_back({var.name(), std::move(min), std::move(extent), {}, {}});
  func_->version++;
}

Func& Func::bound(const Var& var, Expr min, Expr extent) {
  add_bound(func_->schedule.bounds, text("bound ", quoted(var.name()), " of ", quoted(name())), var,
            std::move(min), std::move(extent));
  return *this;
}

Func& Func::bound_extent(const Var& var, Expr extent) { return bound(var, {}, std::move(extent)); }

Func& Func::set_estimate(const Var& var, const Expr& min, const Expr& extent) {
  add_bound(func_->schedule.estimates,
            text("estimate ", quoted(var.name()), " of ", quoted(name())), var, min, extent);
  return *this;
}

Func& Func::set_estimates(const Region& estimates) {
  if (static_cast<int>(estimates.size()) != dimensions()) {
    user_error("set estimates of " + quoted(name()), "there is one for each dimension",
               text("it has ", dimensions(), " dimensions and was given ", estimates.size(),
                    " estimates"));
  }
  const std::vector<Var> variables = args();
  for (int d = 0; d < dimensions(); d++)
    set_estimate(variables[d], estimates[d].min, estimates[d].extent);
  return *this;
}

}  // namespace retrograde
