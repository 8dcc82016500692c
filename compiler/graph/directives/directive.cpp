#include "graph/directives/directive.h"

#include <algorithm>

#include "diagnostics/error.h"
#include "graph/function.h"
#include "graph/names.h"
#include "ir/build.h"

namespace retrograde::graph {

namespace {

size_t place_of(const StageLoops& schedule, const std::string& loop) {
  for (size_t i = 0; i < schedule.dims.size(); ++i) {
    if (schedule.dims[i].var == loop) return i;
  }
  RETROGRADE_ASSERT(false, "a directive names ", quoted(loop), ", which is no loop of its stage");
  return 0;
}

bool has_outermost(const std::vector<Dim>& dims) {
  return !dims.empty() && dims.back().var == outermost_loop;
}

// ---- loops ----

void give(const SplitLoop& split, StageLoops& schedule) {
  const size_t at = place_of(schedule, split.old);
  Dim outer = schedule.dims[at], inner = outer;
  outer.var = split.outer;
  inner.var = split.inner;
  outer.is_in_call = false;  // each call computes the points of the inner loop
  schedule.splits.push_back({Split::Kind::Split, split.old, split.outer, split.inner, split.factor,
                             split.tail, outer.is_reduction});
  schedule.dims[at] = std::move(inner);
  schedule.dims.insert(schedule.dims.begin() + static_cast<std::ptrdiff_t>(at) + 1,
                       std::move(outer));
}

// The outer loop moves directly around the inner one.
void give(const FuseLoops& fuse, StageLoops& schedule) {
  const Dim inner = schedule.dims[place_of(schedule, fuse.inner)];
  const size_t outer_at = place_of(schedule, fuse.outer);
  const Dim outer = schedule.dims[outer_at];
  schedule.dims.erase(schedule.dims.begin() + static_cast<std::ptrdiff_t>(outer_at));
  const bool reduces = inner.is_reduction || outer.is_reduction;
  schedule.dims[place_of(schedule, fuse.inner)] = {fuse.fused, outer.runs, reduces, outer.partition,
                                                   inner.is_in_call && outer.is_in_call};
  schedule.splits.push_back(
      {Split::Kind::Fuse, fuse.fused, fuse.outer, fuse.inner, {}, TailStrategy::Auto, reduces});
}

void give(const RenameLoop& rename, StageLoops& schedule) {
  if (rename.old == rename.renamed) return;
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

void give(const ReorderLoops& reorder, StageLoops& schedule) {
  const auto places =
      mapped(reorder.loops, [&](const std::string& loop) { return place_of(schedule, loop); });
  std::vector<size_t> sorted = places;
  std::ranges::sort(sorted);
  const std::vector<Dim> before = schedule.dims;
  for (size_t i = 0; i < sorted.size(); ++i) schedule.dims[sorted[i]] = before[places[i]];
}

// The outermost loop, which runs once, is added when a directive refers to it.
void give(const RunLoop& run, StageLoops& schedule) {
  if (run.loop == outermost_loop && !has_outermost(schedule.dims))
    schedule.dims.push_back({outermost_loop});
  Dim& loop = schedule.dims[place_of(schedule, run.loop)];
  loop.runs = run.kind;
  loop.is_in_call = false;
}
void give(const PartitionLoop& partition, StageLoops& schedule) {
  schedule.dims[place_of(schedule, partition.loop)].partition = partition.how;
}

// ---- the stage as a whole ----

void give(const MakeAtomic& atomic, StageLoops& schedule) {
  schedule.atomic = true;
  schedule.override_associativity = atomic.vouched;
}
void give(const AllowRaces&, StageLoops& schedule) { schedule.allow_races = true; }
void give(const Unscheduled&, StageLoops&) {}
void give(const PrefetchData& prefetch, StageLoops& schedule) {
  schedule.prefetches.push_back({prefetch.source, prefetch.symbol, prefetch.at, prefetch.from,
                                 prefetch.offset, prefetch.strategy});
}
void give(const ComputeWith& with, StageLoops& schedule) {
  schedule.fuse_level = with.level;
  schedule.fuse_alignment = {with.align.begin(), with.align.end()};
}

// A specialization starts as a copy of the schedule so far.
void give(const Specialize& specialize, StageLoops& schedule) {
  StageLoops copy = schedule;
  copy.specializations.clear();
  copy.condition = specialize.condition;
  copy.failure.clear();
  schedule.specializations.push_back(std::move(copy));
}
void give(const SpecializeFail& fail, StageLoops& schedule) {
  StageLoops failing;
  failing.dims = schedule.dims;
  failing.splits = schedule.splits;
  failing.failure = fail.message.as<StringImm>()->value;
  schedule.specializations.push_back(std::move(failing));
}

// ---- the Func ----

// The storage level follows the compute level unless a directive set it.
void give(const ComputeAt& compute, FuncPlacement& schedule) {
  const bool follows =
      !schedule.store_from && (schedule.store_level.kind == LoopLevel::Kind::Inlined ||
                               schedule.store_level == schedule.compute_level);
  schedule.compute_level = compute.level;
  if (follows) schedule.store_level = compute.level;
}
void give(const StoreAt& store, FuncPlacement& schedule) { schedule.store_level = store.level; }
void give(const HoistStorage& hoist, FuncPlacement& schedule) {
  schedule.hoist_level = hoist.level;
}
void give(const StoreIn& store, FuncPlacement& schedule) { schedule.memory = store.memory; }
void give(const ReorderStorage& reorder, FuncPlacement& schedule) {
  schedule.storage_dims = reorder.dimensions;
}

// The entry for a dimension, created if necessary.
template <typename Entry>
Entry& entry_of(std::vector<Entry>& entries, const std::string& dimension) {
  const auto found =
      std::ranges::find_if(entries, [&](const Entry& e) { return e.var == dimension; });
  if (found != entries.end()) return *found;
  entries.emplace_back().var = dimension;
  return entries.back();
}

void give(const AlignStorage& align, FuncPlacement& schedule) {
  entry_of(schedule.storage_rules, align.dimension).alignment = align.alignment;
}
void give(const BoundStorage& bound, FuncPlacement& schedule) {
  entry_of(schedule.storage_rules, bound.dimension).bound = bound.extent;
}
void give(const FoldStorage& fold, FuncPlacement& schedule) {
  StorageRule& rule = entry_of(schedule.storage_rules, fold.dimension);
  rule.fold = fold.extent;
  rule.fold_forward = fold.forward;
}
void give(const RingBuffer& ring, FuncPlacement& schedule) { schedule.ring = ring.copies; }
void give(const Memoize& memoize, FuncPlacement& schedule) {
  schedule.memoized = true;
  if (memoize.key.defined()) schedule.eviction_key = memoize.key;
}
void give(const Async&, FuncPlacement& schedule) { schedule.async = true; }

// Bounds, estimates and tracing are not part of the schedule: the Func still counts as unscheduled.
void give(const BoundDimension& bound, FuncContents& f) {
  Bound& entry = entry_of(f.schedule.bounds, bound.dimension);
  entry.min = bound.min;
  entry.extent = bound.extent;
}
void give(const AlignBounds& align, FuncContents& f) {
  Bound& entry = entry_of(f.schedule.bounds, align.dimension);
  entry.modulus = align.modulus;
  entry.remainder = align.remainder;
}
void give(const Estimate& estimate, FuncContents& f) {
  Bound& entry = entry_of(f.schedule.estimates, estimate.dimension);
  entry.min = estimate.min;
  entry.extent = estimate.extent;
}
void give(const TraceLoads&, FuncContents& f) { f.trace.loads = true; }
void give(const TraceStores&, FuncContents& f) { f.trace.stores = true; }
void give(const TraceRealizations&, FuncContents& f) { f.trace.realizations = true; }
void give(const AddTraceTag& tag, FuncContents& f) {
  f.trace.tags.push_back(tag.tag.as<StringImm>()->value);
}
void give(const DebugToFile& debug, FuncContents& f) {
  f.debug_file = debug.file.as<StringImm>()->value;
}

template <typename D, typename Schedule>
concept GivenTo = requires(const D& directive, Schedule& schedule) {
  give(directive, schedule);
};

// ---- schedules back to directives ----

Directive directive_of(const Split& split) {
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

std::vector<NamedLoop> loop_names(const std::vector<Dim>& loops) {
  return mapped(loops, [](const Dim& loop) { return NamedLoop(loop.var); });
}

void add_loops(const StageLoops& schedule, const std::vector<Dim>& first,
               std::vector<Directive>& log) {
  StageLoops built;
  built.dims = first;
  for (const Split& split : schedule.splits) {
    log.push_back(directive_of(split));
    apply_directive(log.back(), built);
  }
  if (has_outermost(schedule.dims)) {
    log.push_back(RunLoop{std::string(outermost_loop), schedule.dims.back().runs});
    apply_directive(log.back(), built);
  }
  if (loop_names(built.dims) != loop_names(schedule.dims)) {
    log.push_back(ReorderLoops{loop_names(schedule.dims)});
    apply_directive(log.back(), built);
  }
  for (size_t i = 0; i < schedule.dims.size(); ++i) {
    const Dim &wanted = schedule.dims[i], &now = built.dims[i];
    if (wanted.runs != now.runs || wanted.is_in_call != now.is_in_call)
      log.push_back(RunLoop{wanted.var, wanted.runs});
    if (wanted.partition != now.partition)
      log.push_back(PartitionLoop{wanted.var, wanted.partition});
  }
}

}  // namespace

std::vector<Dim> first_loops(const FuncContents& f, const Definition& definition) {
  std::vector<Dim> loops;
  for (const ReductionVariable& rvar : definition.rvars) {
    if (!rvar.numbers_points) loops.push_back({rvar.var, ForType::Serial, true});
  }
  for (size_t d = 0; d < definition.args.size(); ++d) {
    const Variable* v = definition.args[d].as<Variable>();
    if (v && !v->symbol.defined() && v->name == f.args[d])
      loops.push_back({v->name, ForType::Serial, false, Partition::Auto, f.is_extern()});
  }
  return loops;
}

bool is_of_stage(const Directive& directive) {
  return std::visit(
      []<typename D>(const D&) { return GivenTo<D, StageLoops> || std::is_same_v<D, FactorOut>; },
      directive);
}

const char* name_of(const Directive& directive) {
  return std::visit([](const auto& d) { return d.name; }, directive);
}

std::vector<std::string> directive_names() {
  return []<typename... D>(const std::variant<D...>*) {
    return std::vector<std::string>{D::name...};
  }(static_cast<const Directive*>(nullptr));
}

std::string made_by(const Directive& directive) {
  return std::visit(
      [](const auto& d) -> std::string {
        if constexpr (requires { d.made; }) return d.made;
        return "";
      },
      directive);
}

void apply_directive(const Directive& directive, StageLoops& schedule) {
  schedule.is_given = true;
  std::visit(
      [&]<typename D>(const D& d) {
        if constexpr (GivenTo<D, StageLoops>) return give(d, schedule);
        RETROGRADE_ASSERT((GivenTo<D, StageLoops>), D::name, " is given to no stage");
      },
      directive);
}

// Bounds and estimates do not decide how a Func is computed.
template <typename D>
constexpr bool is_of_sizes = std::is_same_v<D, BoundDimension> || std::is_same_v<D, AlignBounds> ||
                             std::is_same_v<D, Estimate>;

void apply_directive(const Directive& directive, FuncContents& f) {
  std::visit(
      [&]<typename D>(const D& d) {
        if constexpr (GivenTo<D, FuncPlacement>) {
          f.schedule.is_given |= !is_of_sizes<D>;
          give(d, f.schedule);
        } else if constexpr (GivenTo<D, FuncContents>) {
          give(d, f);
        } else {
          RETROGRADE_ASSERT(false, D::name, " is given to no Func");
        }
      },
      directive);
}

std::vector<Directive> directives_of(const StageLoops& schedule, const std::vector<Dim>& first) {
  std::vector<Directive> log;
  add_loops(schedule, first, log);
  if (schedule.atomic) log.push_back(MakeAtomic{schedule.override_associativity});
  if (schedule.allow_races) log.push_back(AllowRaces{});
  for (const PrefetchDirective& p : schedule.prefetches)
    log.push_back(PrefetchData{p.name, p.at, p.from, p.offset, p.strategy, p.symbol});
  if (schedule.fuse_level.kind != LoopLevel::Kind::Inlined) {
    log.push_back(ComputeWith{{schedule.fuse_level},
                              {schedule.fuse_alignment.begin(), schedule.fuse_alignment.end()}});
  }
  if (log.empty() && schedule.is_given) log.push_back(Unscheduled{});
  return log;
}

std::vector<Directive> directives_of(const FuncContents& f) {
  const FuncPlacement& schedule = f.schedule;
  std::vector<Directive> log;
  const bool is_placed = schedule.compute_level.kind != LoopLevel::Kind::Inlined;
  if (schedule.is_given || is_placed) log.push_back(ComputeAt{{schedule.compute_level}});
  if (!(schedule.store_level == schedule.compute_level))
    log.push_back(StoreAt{{schedule.store_level}});
  if (schedule.hoist_level.kind != LoopLevel::Kind::Inlined)
    log.push_back(HoistStorage{{schedule.hoist_level}});
  if (schedule.memory != MemoryType::Auto) log.push_back(StoreIn{schedule.memory});
  if (schedule.storage_dims != f.args) log.push_back(ReorderStorage{schedule.storage_dims});
  for (const StorageRule& rule : schedule.storage_rules) {
    if (rule.alignment.defined()) log.push_back(AlignStorage{rule.var, rule.alignment});
    if (rule.bound.defined()) log.push_back(BoundStorage{rule.var, rule.bound});
    if (rule.fold.defined()) log.push_back(FoldStorage{rule.var, rule.fold, rule.fold_forward});
  }
  if (schedule.ring.defined()) log.push_back(RingBuffer{schedule.ring});
  if (schedule.memoized) log.push_back(Memoize{schedule.eviction_key});
  if (schedule.async) log.push_back(Async{});
  for (const Bound& bound : schedule.bounds) {
    if (bound.extent.defined()) log.push_back(BoundDimension{bound.var, bound.min, bound.extent});
    if (bound.modulus.defined())
      log.push_back(AlignBounds{bound.var, bound.modulus, bound.remainder});
  }
  for (const Bound& guess : schedule.estimates)
    log.push_back(Estimate{guess.var, guess.min, guess.extent});
  if (f.trace.loads) log.push_back(TraceLoads{});
  if (f.trace.stores) log.push_back(TraceStores{});
  if (f.trace.realizations) log.push_back(TraceRealizations{});
  for (const std::string& tag : f.trace.tags) log.push_back(AddTraceTag{tag});
  if (!f.debug_file.empty()) log.push_back(DebugToFile{f.debug_file});
  return log;
}

}  // namespace retrograde::graph
