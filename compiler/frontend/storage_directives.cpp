// storage_directives.cpp -- where a Func is computed and stored, how its storage is laid out, what
// is known of its size, and what is reported of it.
//
// Every directive checks what can be known when it is given; what depends on other Funcs' schedules
// is checked when the pipeline is compiled.
#include <algorithm>

#include "frontend/func.h"
#include "graph/define.h"
#include "graph/directive.h"
#include "ir/literal.h"
#include "ir/print.h"
#include "ir/visit.h"

namespace retrograde {

namespace {

using LevelSource = std::shared_ptr<ir::LoopLevelContents> ir::FuncSchedule::*;
using LevelAssignment = void (*)(ir::FuncSchedule&, const ir::LoopLevel&);

void set_compute_level(ir::FuncSchedule& schedule, const ir::LoopLevel& level) {
  ir::apply_directive(ir::ComputeAt{level}, schedule);
}
void set_store_level(ir::FuncSchedule& schedule, const ir::LoopLevel& level) {
  schedule.store_level = level;
}
void set_hoist_level(ir::FuncSchedule& schedule, const ir::LoopLevel& level) {
  schedule.hoist_level = level;
}

// The schedule says what the user's object says, also when that is set later.
void follow(const ir::FuncPtr& f, const LoopLevel& level, LevelSource source,
            LevelAssignment assign) {
  const auto& contents = level.contents();
  f->schedule.*source = contents;
  if (contents->defined) assign(f->schedule, contents->level);
  const ir::LoopLevelContents* raw = contents.get();
  contents->followers.push_back([=, weak = f->weak_from_this()](const ir::LoopLevel& now) {
    const auto func = weak.lock();
    if (!func || (func->schedule.*source).get() != raw) return;  // it was given another level since
    assign(func->schedule, now);
    func->version++;
  });
}

std::string dimensions_of(const ir::FuncContents& f) {
  std::string args;
  for (const std::string& arg : f.args) args += (args.empty() ? "" : ", ") + quoted(arg);
  return args.empty() ? "it has no dimensions" : "its variables are " + args;
}

}  // namespace

ir::FuncSchedule& Func::touch() {
  func_->version++;
  func_->schedule.touched = true;
  return func_->schedule;
}

// ---- levels ----

Func& Func::compute_inline() { return compute_at(LoopLevel::inlined()); }
Func& Func::compute_root() { return compute_at(LoopLevel::root()); }
Func& Func::store_root() { return store_at(LoopLevel::root()); }
Func& Func::hoist_storage_root() { return hoist_storage(LoopLevel::root()); }

Func& Func::compute_at(const LoopLevel& level) {
  touch();
  follow(func_, level, &ir::FuncSchedule::compute_from, set_compute_level);
  return *this;
}

Func& Func::store_at(const LoopLevel& level) {
  touch();
  follow(func_, level, &ir::FuncSchedule::store_from, set_store_level);
  return *this;
}

Func& Func::hoist_storage(const LoopLevel& level) {
  touch();
  follow(func_, level, &ir::FuncSchedule::hoist_from, set_hoist_level);
  return *this;
}

// ---- layout ----

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
      user_error(asked, quoted(dim.name()) + " must be one of its dimensions",
                 dimensions_of(*func_), "Name one of them");
    const size_t place = static_cast<size_t>(it - storage.begin());
    if (std::find(places.begin(), places.end(), place) != places.end()) {
      user_error(asked, "each dimension is named once", quoted(dim.name()) + " is named twice",
                 "Drop one of them");
    }
    places.push_back(place);
  }
  std::sort(places.begin(), places.end());
  for (size_t i = 0; i < dims.size(); i++) storage[places[i]] = dims[i].name();
  return *this;
}

void Func::check_is_dimension(const Var& var, const std::string& asked) const {
  check_defined(asked);
  if (std::find(func_->args.begin(), func_->args.end(), var.name()) != func_->args.end()) return;
  user_error(asked, quoted(var.name()) + " must be a pure variable of the first definition",
             dimensions_of(*func_), "Name one of them");
}

// An integer as int32; positive when it is known.
Expr Func::checked_size(Expr e, const char* what, const std::string& asked) const {
  if (!e.defined())
    user_error(asked, text("the ", what, " must be a defined expression"), "it was never assigned",
               "Assign every Expr before it is used");
  if (!e.type().is_int_or_uint() || !e.type().is_scalar()) {
    user_error(asked, text("the ", what, " is an integer"),
               text(e, " has type ", to_string(e.type())), "Give an integer");
  }
  ir::check_over_parameters(e, text("the ", what).c_str(), asked);
  const auto constant = ir::as_const_int(e);
  if (constant && (*constant <= 0 || *constant > INT32_MAX)) {
    user_error(asked, text("the ", what, " is at least 1 and fits an int32"),
               text("it is ", *constant), "Give a positive number");
  }
  return ir::cast_to(Int(32), std::move(e));
}

ir::StorageRule& Func::storage_rule(const Var& dim, const std::string& asked) {
  check_is_dimension(dim, asked);
  std::vector<ir::StorageRule>& rules = touch().storage_rules;
  for (ir::StorageRule& rule : rules) {
    if (rule.var == dim.name()) return rule;
  }
  ir::StorageRule rule;
  rule.var = dim.name();
  rules.push_back(std::move(rule));
  return rules.back();
}

Func& Func::align_storage(const Var& dim, const Expr& alignment) {
  const std::string asked =
      text("align the storage of ", quoted(name()), " in ", quoted(dim.name()));
  Expr checked = checked_size(alignment, "alignment", asked);
  storage_rule(dim, asked).alignment = std::move(checked);
  return *this;
}

Func& Func::fold_storage(const Var& dim, const Expr& extent, bool fold_forward) {
  const std::string asked =
      text("fold the storage of ", quoted(name()), " in ", quoted(dim.name()));
  Expr checked = checked_size(extent, "extent", asked);
  ir::StorageRule& rule = storage_rule(dim, asked);
  rule.fold = std::move(checked);
  rule.fold_forward = fold_forward;
  return *this;
}

Func& Func::bound_storage(const Var& dim, const Expr& bound) {
  const std::string asked =
      text("bound the storage of ", quoted(name()), " in ", quoted(dim.name()));
  Expr checked = checked_size(bound, "bound", asked);
  storage_rule(dim, asked).bound = std::move(checked);
  return *this;
}

Func& Func::memoize(const EvictionKey& eviction_key) {
  const std::string asked = "memoize " + quoted(name());
  if (const Expr& key = eviction_key.key(); key.defined()) {
    if (!key.type().is_int_or_uint() && !key.type().is_handle()) {
      user_error(asked, "an eviction key is an integer or a pointer",
                 text(key, " has type ", to_string(key.type())), "Convert it to uint64");
    }
    ir::check_over_parameters(key, "the eviction key", asked);
    if (const Expr& given = func_->schedule.eviction_key; given.defined()) {
      user_error(asked, "a Func has one eviction key",
                 text("it was given ", given, " before, and now ", key),
                 "Give the key once; combine two with arithmetic");
    }
  }
  ir::FuncSchedule& schedule = touch();
  schedule.memoized = true;
  if (eviction_key.key().defined()) schedule.eviction_key = eviction_key.key();
  return *this;
}

Func& Func::async() {
  touch().async = true;
  return *this;
}

// ---- sizes ----

namespace {

ir::Bound& bound_of(std::vector<ir::Bound>& bounds, const std::string& var) {
  for (ir::Bound& bound : bounds) {
    if (bound.var == var) return bound;
  }
  bounds.push_back({var, {}, {}, {}, {}});
  return bounds.back();
}

// Promises about one variable that cannot hold together, where they are constants.
void check_alignment(const ir::Bound& bound, const std::string& asked) {
  if (!bound.modulus.defined()) return;
  const auto constant = [](const Expr& e) {
    return e.defined() ? ir::as_const_int(e) : std::nullopt;
  };
  const auto modulus = constant(bound.modulus), min = constant(bound.min);
  const auto extent = constant(bound.extent), remainder = constant(bound.remainder);
  if (modulus && extent && *extent % *modulus != 0) {
    user_error(asked, "the extent is a multiple of the modulus",
               text("the extent is ", *extent, " and the modulus ", *modulus),
               "Bound it to a multiple");
  }
  if (modulus && min && remainder && ((*min - *remainder) % *modulus) != 0) {
    user_error(asked, text("min % ", *modulus, " is the remainder ", *remainder),
               text("the min is ", *min), "Give the remainder that the min has");
  }
}

}  // namespace

void Func::add_bound(std::vector<ir::Bound>& bounds, const std::string& asked, const Var& var,
                     Expr min, Expr extent) {
  check_is_dimension(var, asked);
  if (!extent.defined())
    user_error(asked, "the extent must be a defined expression", "it was never assigned",
               "Give the extent");
  for (Expr* e : {&min, &extent}) {
    if (!e->defined()) continue;
    if (!e->type().is_int_or_uint() || !e->type().is_scalar()) {
      user_error(asked, "bounds are integers", text(*e, " has type ", to_string(e->type())),
                 "Convert it: cast<int>(...)");
    }
    ir::check_over_parameters(*e, "a bound", asked);
    *e = ir::int32_literal(*e, asked);
  }
  const auto constant = ir::as_const_int(extent);
  if (constant && *constant < 0)
    user_error(asked, "an extent is not negative", text("it is ", *constant), "Give 0 or more");
  ir::Bound changed = bound_of(bounds, var.name());
  changed.min = std::move(min);
  changed.extent = std::move(extent);
  check_alignment(changed, asked);
  bound_of(bounds, var.name()) = std::move(changed);
  func_->version++;
}

Func& Func::bound(const Var& var, Expr min, Expr extent) {
  add_bound(func_->schedule.bounds, text("bound ", quoted(var.name()), " of ", quoted(name())), var,
            std::move(min), std::move(extent));
  return *this;
}

Func& Func::bound_extent(const Var& var, Expr extent) { return bound(var, {}, std::move(extent)); }

Func& Func::align_bounds(const Var& var, Expr modulus, Expr remainder) {
  const std::string asked =
      text("align the bounds of ", quoted(var.name()), " of ", quoted(name()));
  check_is_dimension(var, asked);
  modulus = checked_size(std::move(modulus), "modulus", asked);
  if (remainder.defined()) {
    if (!remainder.type().is_int_or_uint() || !remainder.type().is_scalar()) {
      user_error(asked, "the remainder is an integer",
                 text(remainder, " has type ", to_string(remainder.type())), "Give an integer");
    }
    ir::check_over_parameters(remainder, "the remainder", asked);
    remainder = ir::int32_literal(std::move(remainder), asked);
  }
  ir::Bound changed = bound_of(func_->schedule.bounds, var.name());
  changed.modulus = std::move(modulus);
  changed.remainder = std::move(remainder);
  check_alignment(changed, asked);
  bound_of(func_->schedule.bounds, var.name()) = std::move(changed);
  func_->version++;
  return *this;
}

Func& Func::align_extent(const Var& var, Expr modulus) {
  return align_bounds(var, std::move(modulus), {});
}

Func& Func::set_estimate(const Var& var, const Expr& min, const Expr& extent) {
  add_bound(func_->schedule.estimates,
            text("estimate ", quoted(var.name()), " of ", quoted(name())), var, min, extent);
  return *this;
}

Func& Func::set_estimates(const Region& estimates) {
  if (static_cast<int>(estimates.size()) != dimensions()) {
    user_error(
        "set estimates of " + quoted(name()), "there is one for each dimension",
        text("it has ", dimensions(), " dimensions and was given ", estimates.size(), " estimates"),
        "Give that many");
  }
  const std::vector<Var> variables = args();
  for (int d = 0; d < dimensions(); d++)
    set_estimate(variables[d], estimates[d].min, estimates[d].extent);
  return *this;
}

// ---- watching ----

Func& Func::trace_loads() {
  func_->trace.loads = true;
  func_->version++;
  return *this;
}

Func& Func::trace_stores() {
  func_->trace.stores = true;
  func_->version++;
  return *this;
}

Func& Func::trace_realizations() {
  func_->trace.realizations = true;
  func_->version++;
  return *this;
}

Func& Func::add_trace_tag(const std::string& tag) {
  func_->trace.tags.push_back(tag);
  func_->version++;
  return *this;
}

void Func::debug_to_file(const std::string& filename) {
  if (filename.empty()) {
    user_error("write " + quoted(name()) + " to a file", "the file has a name", "it is empty",
               "Give a name that ends in .npy or .tmp");
  }
  func_->debug_file = filename;
  func_->version++;
}

}  // namespace retrograde
