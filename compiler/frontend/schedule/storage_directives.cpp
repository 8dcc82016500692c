// storage_directives.cpp -- what schedules of Funcs are in terms of directives, which
// graph/give_directive.h checks, applies and logs.
#include "frontend/language/func.h"

namespace retrograde {

Func& Func::give(ir::Directive directive) {
  ir::give_directive({func_}, std::move(directive));
  return *this;
}

// ---- levels ----

Func& Func::compute_inline() { return compute_at(LoopLevel::inlined()); }
Func& Func::compute_root() { return compute_at(LoopLevel::root()); }
Func& Func::store_root() { return store_at(LoopLevel::root()); }
Func& Func::hoist_storage_root() { return hoist_storage(LoopLevel::root()); }
Func& Func::compute_at(const LoopLevel& level) {
  return give(ir::ComputeAt{{{}, level.contents()}});
}
Func& Func::store_at(const LoopLevel& level) { return give(ir::StoreAt{{{}, level.contents()}}); }
Func& Func::hoist_storage(const LoopLevel& level) {
  return give(ir::HoistStorage{{{}, level.contents()}});
}

// ---- layout ----

Func& Func::store_in(MemoryType memory) { return give(ir::StoreIn{memory}); }
Func& Func::reorder_storage(const std::vector<Var>& dims) {
  std::vector<std::string> names;
  for (const Var& dim : dims) names.push_back(dim.name());
  return give(ir::ReorderStorage{std::move(names)});
}
Func& Func::align_storage(const Var& dim, const Expr& alignment) {
  return give(ir::AlignStorage{dim.name(), alignment});
}
Func& Func::fold_storage(const Var& dim, const Expr& extent, bool fold_forward) {
  return give(ir::FoldStorage{dim.name(), extent, fold_forward});
}
Func& Func::bound_storage(const Var& dim, const Expr& bound) {
  return give(ir::BoundStorage{dim.name(), bound});
}
Func& Func::memoize(const EvictionKey& eviction_key) {
  return give(ir::Memoize{eviction_key.key()});
}
Func& Func::async() { return give(ir::Async{}); }

// ---- sizes ----

Func& Func::bound(const Var& var, Expr min, Expr extent) {
  return give(ir::BoundDimension{var.name(), std::move(min), std::move(extent)});
}
Func& Func::bound_extent(const Var& var, Expr extent) { return bound(var, {}, std::move(extent)); }
Func& Func::align_bounds(const Var& var, Expr modulus, Expr remainder) {
  return give(ir::AlignBounds{var.name(), std::move(modulus), std::move(remainder)});
}
Func& Func::align_extent(const Var& var, Expr modulus) {
  return align_bounds(var, std::move(modulus), {});
}
Func& Func::set_estimate(const Var& var, const Expr& min, const Expr& extent) {
  return give(ir::Estimate{var.name(), min, extent});
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

Func& Func::trace_loads() { return give(ir::TraceLoads{}); }
Func& Func::trace_stores() { return give(ir::TraceStores{}); }
Func& Func::trace_realizations() { return give(ir::TraceRealizations{}); }
Func& Func::add_trace_tag(const std::string& tag) { return give(ir::AddTraceTag{tag}); }
void Func::debug_to_file(const std::string& filename) { give(ir::DebugToFile{filename}); }

}  // namespace retrograde
