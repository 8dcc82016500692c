#include "graph/directive.h"

#include <algorithm>

#include "diagnostics/error.h"
#include "graph/function.h"
#include "ir/build.h"

namespace retrograde::ir {

namespace {

size_t place_of(const StageSchedule& schedule, const std::string& loop) {
  for (size_t i = 0; i < schedule.dims.size(); ++i) {
    if (schedule.dims[i].var == loop) return i;
  }
  RETROGRADE_ASSERT(false, "a directive names ", quoted(loop), ", which is no loop of its stage");
  return 0;
}

// ---- loops ----

void give(const SplitLoop& split, StageSchedule& schedule) {
  const size_t at = place_of(schedule, split.old);
  Dim outer = schedule.dims[at], inner = outer;
  outer.var = split.outer;
  inner.var = split.inner;
  schedule.splits.push_back({Split::Kind::Split, split.old, split.outer, split.inner, split.factor,
                             split.tail, outer.is_reduction});
  schedule.dims[at] = std::move(inner);
  schedule.dims.insert(schedule.dims.begin() + static_cast<std::ptrdiff_t>(at) + 1,
                       std::move(outer));
}

// The outer loop comes to stand directly around the inner one.
void give(const FuseLoops& fuse, StageSchedule& schedule) {
  const Dim inner = schedule.dims[place_of(schedule, fuse.inner)];
  const size_t outer_at = place_of(schedule, fuse.outer);
  const Dim outer = schedule.dims[outer_at];
  schedule.dims.erase(schedule.dims.begin() + static_cast<std::ptrdiff_t>(outer_at));
  const bool reduces = inner.is_reduction || outer.is_reduction;
  schedule.dims[place_of(schedule, fuse.inner)] = {fuse.fused, outer.for_type, reduces,
                                                   outer.partition};
  schedule.splits.push_back(
      {Split::Kind::Fuse, fuse.fused, fuse.outer, fuse.inner, {}, TailStrategy::Auto, reduces});
}

void give(const RenameLoop& rename, StageSchedule& schedule) {
  Dim& loop = schedule.dims[place_of(schedule, rename.old)];
  schedule.splits.push_back({Split::Kind::Rename,
                             rename.old,
                             rename.renamed,
                             "",
                             {},
                             TailStrategy::Auto,
                             loop.is_reduction});
  loop.var = rename.renamed;
}

void give(const ReorderLoops& reorder, StageSchedule& schedule) {
  std::vector<size_t> places;
  for (const std::string& loop : reorder.loops) places.push_back(place_of(schedule, loop));
  std::vector<size_t> sorted = places;
  std::sort(sorted.begin(), sorted.end());
  const std::vector<Dim> before = schedule.dims;
  for (size_t i = 0; i < sorted.size(); ++i) schedule.dims[sorted[i]] = before[places[i]];
}

void give(const RunLoop& run, StageSchedule& schedule) {
  schedule.dims[place_of(schedule, run.loop)].for_type = run.kind;
}
void give(const PartitionLoop& partition, StageSchedule& schedule) {
  schedule.dims[place_of(schedule, partition.loop)].partition = partition.how;
}

// ---- the stage as a whole ----

void give(const MakeAtomic& atomic, StageSchedule& schedule) {
  schedule.atomic = true;
  schedule.override_associativity = atomic.vouched;
}
void give(const AllowRaces&, StageSchedule& schedule) { schedule.allow_races = true; }
void give(const Unscheduled&, StageSchedule&) {}
void give(const PrefetchData& prefetch, StageSchedule& schedule) {
  schedule.prefetches.push_back(
      {prefetch.source, {}, prefetch.at, prefetch.from, prefetch.offset, prefetch.strategy});
}
void give(const ComputeWith& with, StageSchedule& schedule) {
  schedule.fuse_level = with.level;
  schedule.fuse_alignment.clear();
}
void give(const AlignLoop& align, StageSchedule& schedule) {
  schedule.fuse_alignment[align.loop] = align.how;
}

// ---- the Func ----

// Storing follows computing, unless it was asked for elsewhere.
void give(const ComputeAt& compute, FuncSchedule& schedule) {
  const bool follows =
      !schedule.store_from && (schedule.store_level.kind == LoopLevel::Kind::Inlined ||
                               schedule.store_level == schedule.compute_level);
  schedule.compute_level = compute.level;
  if (follows) schedule.store_level = compute.level;
  schedule.touched = true;
}
void give(const StoreAt& store, FuncSchedule& schedule) {
  schedule.store_level = store.level;
  schedule.touched = true;
}
void give(const HoistStorage& hoist, FuncSchedule& schedule) {
  schedule.hoist_level = hoist.level;
  schedule.touched = true;
}
void give(const StoreIn& store, FuncSchedule& schedule) {
  schedule.memory = store.memory;
  schedule.touched = true;
}
void give(const ReorderStorage& reorder, FuncSchedule& schedule) {
  schedule.storage_dims = reorder.dimensions;
  schedule.touched = true;
}

// The entry for a dimension, made when there is none.
template <typename Entry>
Entry& entry_of(std::vector<Entry>& entries, const std::string& dimension) {
  const auto found = std::find_if(entries.begin(), entries.end(),
                                  [&](const Entry& e) { return e.var == dimension; });
  if (found != entries.end()) return *found;
  entries.emplace_back().var = dimension;
  return entries.back();
}
StorageRule& rule_of(FuncSchedule& schedule, const std::string& dimension) {
  schedule.touched = true;
  return entry_of(schedule.storage_rules, dimension);
}

void give(const AlignStorage& align, FuncSchedule& schedule) {
  rule_of(schedule, align.dimension).alignment = align.alignment;
}
void give(const BoundStorage& bound, FuncSchedule& schedule) {
  rule_of(schedule, bound.dimension).bound = bound.extent;
}
void give(const FoldStorage& fold, FuncSchedule& schedule) {
  StorageRule& rule = rule_of(schedule, fold.dimension);
  rule.fold = fold.extent;
  rule.fold_forward = fold.forward;
}
void give(const Memoize& memoize, FuncSchedule& schedule) {
  schedule.memoized = schedule.touched = true;
  if (memoize.key.defined()) schedule.eviction_key = memoize.key;
}
void give(const Async&, FuncSchedule& schedule) { schedule.async = schedule.touched = true; }

// What is known of sizes is no schedule: it leaves a Func untouched.
void give(const BoundDimension& bound, FuncSchedule& schedule) {
  Bound& entry = entry_of(schedule.bounds, bound.dimension);
  entry.min = bound.min;
  entry.extent = bound.extent;
}
void give(const AlignBounds& align, FuncSchedule& schedule) {
  Bound& entry = entry_of(schedule.bounds, align.dimension);
  entry.modulus = align.modulus;
  entry.remainder = align.remainder;
}
void give(const Estimate& estimate, FuncSchedule& schedule) {
  Bound& entry = entry_of(schedule.estimates, estimate.dimension);
  entry.min = estimate.min;
  entry.extent = estimate.extent;
}

// ---- and back ----

StageDirective directive_of(const Split& split) {
  switch (split.kind) {
    case Split::Kind::Split:
      return SplitLoop{split.old_var, split.outer, split.inner, split.factor, split.tail};
    case Split::Kind::Fuse:
      return FuseLoops{split.inner, split.outer, split.old_var};
    case Split::Kind::Rename:
      break;
  }
  return RenameLoop{split.old_var, split.outer};
}

std::vector<std::string> names_of(const std::vector<Dim>& loops) {
  std::vector<std::string> names;
  for (const Dim& loop : loops) names.push_back(loop.var);
  return names;
}

void add_loops(const StageSchedule& schedule, const std::vector<Dim>& first,
               std::vector<StageDirective>& log) {
  StageSchedule built;
  built.dims = first;
  for (const Split& split : schedule.splits) {
    log.push_back(directive_of(split));
    apply_directive(log.back(), built);
  }
  if (names_of(built.dims) != names_of(schedule.dims)) {
    log.push_back(ReorderLoops{names_of(schedule.dims)});
    apply_directive(log.back(), built);
  }
  for (size_t i = 0; i < schedule.dims.size(); ++i) {
    const Dim &wanted = schedule.dims[i], &now = built.dims[i];
    if (wanted.for_type != now.for_type) log.push_back(RunLoop{wanted.var, wanted.for_type});
    if (wanted.partition != now.partition)
      log.push_back(PartitionLoop{wanted.var, wanted.partition});
  }
}

}  // namespace

std::vector<Dim> first_loops(const FuncContents& f, const Definition& definition) {
  std::vector<Dim> loops;
  if (f.is_extern()) return loops;
  for (const ReductionVariable& rvar : definition.rvars)
    loops.push_back({rvar.var, ForType::Serial, true});
  for (size_t d = 0; d < definition.args.size(); ++d) {
    const Variable* v = definition.args[d].as<Variable>();
    if (v && !v->symbol.defined() && v->name == f.args[d])
      loops.push_back({v->name, ForType::Serial, false});
  }
  return loops;
}

void apply_directive(const StageDirective& directive, StageSchedule& schedule) {
  schedule.touched = true;
  std::visit([&](const auto& d) { give(d, schedule); }, directive);
}

void apply_directive(const FuncDirective& directive, FuncSchedule& schedule) {
  std::visit([&](const auto& d) { give(d, schedule); }, directive);
}

std::vector<StageDirective> directives_of(const StageSchedule& schedule,
                                          const std::vector<Dim>& first) {
  std::vector<StageDirective> log;
  add_loops(schedule, first, log);
  if (schedule.atomic) log.push_back(MakeAtomic{schedule.override_associativity});
  if (schedule.allow_races) log.push_back(AllowRaces{});
  for (const PrefetchDirective& p : schedule.prefetches)
    log.push_back(PrefetchData{p.name, p.at, p.from, p.offset, p.strategy});
  if (schedule.fuse_level.kind != LoopLevel::Kind::Inlined)
    log.push_back(ComputeWith{schedule.fuse_level});
  for (const auto& [loop, how] : schedule.fuse_alignment) log.push_back(AlignLoop{loop, how});
  if (log.empty() && schedule.touched) log.push_back(Unscheduled{});
  return log;
}

std::vector<FuncDirective> directives_of(const FuncSchedule& schedule,
                                         const std::vector<std::string>& dimensions) {
  std::vector<FuncDirective> log;
  const bool is_placed = schedule.compute_level.kind != LoopLevel::Kind::Inlined;
  if (schedule.touched || is_placed) log.push_back(ComputeAt{schedule.compute_level});
  if (!(schedule.store_level == schedule.compute_level))
    log.push_back(StoreAt{schedule.store_level});
  if (schedule.hoist_level.kind != LoopLevel::Kind::Inlined)
    log.push_back(HoistStorage{schedule.hoist_level});
  if (schedule.memory != MemoryType::Auto) log.push_back(StoreIn{schedule.memory});
  if (schedule.storage_dims != dimensions) log.push_back(ReorderStorage{schedule.storage_dims});
  for (const StorageRule& rule : schedule.storage_rules) {
    if (rule.alignment.defined()) log.push_back(AlignStorage{rule.var, rule.alignment});
    if (rule.bound.defined()) log.push_back(BoundStorage{rule.var, rule.bound});
    if (rule.fold.defined()) log.push_back(FoldStorage{rule.var, rule.fold, rule.fold_forward});
  }
  if (schedule.memoized) log.push_back(Memoize{schedule.eviction_key});
  if (schedule.async) log.push_back(Async{});
  for (const Bound& bound : schedule.bounds) {
    if (bound.extent.defined()) log.push_back(BoundDimension{bound.var, bound.min, bound.extent});
    if (bound.modulus.defined())
      log.push_back(AlignBounds{bound.var, bound.modulus, bound.remainder});
  }
  for (const Bound& guess : schedule.estimates)
    log.push_back(Estimate{guess.var, guess.min, guess.extent});
  return log;
}

}  // namespace retrograde::ir
