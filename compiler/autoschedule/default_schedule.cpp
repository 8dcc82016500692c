#include "autoschedule/default_schedule.h"

#include <algorithm>
#include <optional>
#include <unordered_set>

#include "autoschedule/atomic_scatters.h"
#include "autoschedule/choices.h"
#include "autoschedule/chosen_places.h"
#include "autoschedule/column_blocks.h"
#include "autoschedule/cut_reductions.h"
#include "autoschedule/cut_scatters.h"
#include "autoschedule/epilogues.h"
#include "autoschedule/join_sweeps.h"
#include "autoschedule/lane_dimension.h"
#include "autoschedule/new_loop.h"
#include "autoschedule/only_reader.h"
#include "autoschedule/placement_limits.h"
#include "autoschedule/point_funcs.h"
#include "autoschedule/point_loops.h"
#include "autoschedule/reduction_slices.h"
#include "autoschedule/root_loops.h"
#include "autoschedule/row_hosts.h"
#include "autoschedule/row_order.h"
#include "autoschedule/row_sweeps.h"
#include "autoschedule/row_tasks.h"
#include "autoschedule/scatter_schedule.h"
#include "autoschedule/scatter_slices.h"
#include "autoschedule/slices.h"
#include "autoschedule/start_in_tiles.h"
#include "autoschedule/step_sums.h"
#include "autoschedule/stored_funcs.h"
#include "autoschedule/strips.h"
#include "autoschedule/sum_blocks.h"
#include "autoschedule/task_sizes.h"
#include "autoschedule/tile_chains.h"
#include "frontend/language/func.h"
#include "graph/copy_graph.h"
#include "graph/definitions/own_reads.h"
#include "graph/directives/give_directive.h"

namespace retrograde::autoschedule {

namespace {

// The updates before what they start from: a sum that gets tiles starts in them (`started`), when it
// is known which loops they end up in.
void give_loops(const FuncPtr& f, const ScheduleRequest& request, const SizeEstimate& sizes,
                std::vector<FuncPtr>& started) {
  for (int s = 1; s < f->stage_count(); ++s) give_root_loops(f, s, request, sizes);
  if (request.makes(Decision::RegisterTiles) && has_tiles(*f))
    started.push_back(f);
  else
    give_root_loops(f, 0, request, sizes);
}

void start_sums(const FuncPtr& f, const ScheduleRequest& request, const SizeEstimate& sizes) {
  if (has_tiles(*f)) return start_in_tiles(f, schedule_lanes);
  give_root_loops(f, 0, request, sizes);
  if (!is_at_root(*f)) run_serially(f);
}

// Pure Funcs.
void compute_at_root(const std::vector<FuncPtr>& funcs, const ScheduleRequest& request) {
  for (const FuncPtr& f : funcs) {
    Func(f).compute_root();
    give_root_loops(f, 0, request, SizeEstimate());
  }
}

// A scatter, or what reads slices of one or adds parts of one up: all of its loops; false: none of
// these.
bool schedule_scatter(const FuncPtr& f, const SlicedScatters& slices, const SizeEstimate& sizes) {
  if (const ScatterSlices* sliced = slices.of_scatter(*f)) {
    schedule_scatter_lanes(f, sliced->lanes, sizes, true);
  } else if (const ScatterSlices* read = slices.of_reader(*f)) {
    schedule_slices(*read);
  } else if (const auto lanes = scatter_lanes(*f, sizes)) {
    schedule_scatter_lanes(f, *lanes, sizes);
  } else if (const auto layout = layout_of_parts(*f)) {
    schedule_sum_of_parts(f, *layout, sizes);
  } else {
    return false;
  }
  return true;
}

std::vector<FuncPtr> pure_primal(std::vector<FuncPtr> funcs) {
  std::erase_if(funcs, [](const FuncPtr& f) { return !f->is_pure() || f->made; });
  return funcs;
}

// Sums to a few elements. What has its loops after that is no longer among the stored.
void cut_sums(const std::vector<FuncPtr>& outputs, std::vector<FuncPtr>& stored,
              const std::unordered_set<const Symbol*>& whole, const ChosenPlaces& chosen,
              const ScheduleRequest& request, const SizeEstimate& sizes) {
  if (!request.makes(Decision::CutReductions)) return;
  std::unordered_set<const Symbol*> kept = whole;  // at root
  kept.insert(chosen.store.begin(), chosen.store.end());
  if (request.makes(Decision::JoinSweeps)) sweep_rows(outputs, stored, kept, sizes);
  cut_reductions(outputs, sizes, request.machine, whole);
  if (request.makes(Decision::ScatterStrategy)) cut_scatters(outputs, sizes, whole);
}

// Funcs that have loops of this scheduler's, and what must be known to move them.
struct Movable {
  const std::vector<FuncPtr>& outputs;
  std::vector<FuncPtr> stored;
  std::vector<FuncPtr> given;  // of these: loops, at root
  const std::unordered_set<const Symbol*>& whole;
  const Readers& before;  // before loops were given
  const SizeEstimate& sizes;
};

// What is computed in the loops of others, and which loops are shared. What belongs to tiles of sums
// moves first, and then no more.
void move_and_join(Movable funcs, const ScheduleRequest& request, const GiveLoopsOfRows& give_rows,
                   const GiveLoopsOfTile& give_tile) {
  auto& [outputs, stored, given, whole, before, sizes] = funcs;
  const bool slices = request.makes(Decision::Slices);
  const bool joins = request.makes(Decision::JoinSweeps);
  std::unordered_set<const Symbol*> together = whole;  // what is to share loops does not move
  if (slices && joins) together.merge(sweeps_that_join(outputs, given, sizes));
  if (slices) {
    for (const FuncPtr& f :
         compute_epilogues(outputs, before, given, together, schedule_lanes, give_tile)) {
      std::erase(stored, f);
      std::erase(given, f);
    }
  }
  const Readers readers(outputs, stored);
  if (request.makes(Decision::Choices)) compute_beside_choices(readers, given, whole);
  if (slices) compute_in_column_blocks(readers, stored, whole, sizes);
  if (slices) compute_in_tiles(outputs, readers, given, whole, sizes);
  // Of chains of stencils, before these are put into strips of their own.
  if (slices) compute_in_reductions(outputs, readers, pure_primal(stored), whole, sizes);
  if (request.makes(Decision::Strips)) {
    compute_in_strips(outputs, given, whole, sizes, give_rows);
  }
  if (slices) compute_sums_in_blocks(outputs, before, given, together, sizes);
  if (slices) compute_in_slices(readers, stored, whole, sizes);
  if (slices) compute_in_reductions(outputs, readers, stored, whole, sizes);
  if (request.makes(Decision::LayoutStaging)) run_along_rows(given, sizes);
  if (joins) join_sweeps(outputs, given, sizes);
}

// `chosen`: what stays at root; `slices`, `along`: what gets other loops.
RowHosts find_row_hosts(const std::vector<FuncPtr>& outputs, const std::vector<FuncPtr>& stored,
                        std::unordered_set<const Symbol*> excluded, const ChosenPlaces& chosen,
                        const SlicedScatters& slices, const LaneDimensions& along,
                        const SizeEstimate& sizes) {
  excluded.insert(chosen.store.begin(), chosen.store.end());
  for (const FuncPtr& f : stored) {
    if (slices.of_scatter(*f) || slices.of_reader(*f) || along.of(*f) > 0) excluded.insert(f.get());
  }
  return RowHosts(outputs, stored, excluded, sizes);
}

// `rows`, `slices`: what gets other loops.
PointFuncs find_point_funcs(const std::vector<FuncPtr>& outputs, const std::vector<FuncPtr>& stored,
                            std::unordered_set<const Symbol*> excluded, const RowHosts& rows,
                            const SlicedScatters& slices, const SizeEstimate& sizes) {
  excluded.merge(rows.all());
  for (const FuncPtr& f : stored) {
    if (slices.of_scatter(*f) || slices.of_reader(*f) || layout_of_parts(*f))
      excluded.insert(f.get());
  }
  return PointFuncs(outputs, stored, excluded, schedule_lanes, sizes);
}

// Moves what has loops over points, when all have loops. Nothing else moves it.
void move_point_funcs(const std::vector<FuncPtr>& funcs, const PointFuncs& points,
                      const Readers& readers, const ChosenPlaces& chosen,
                      std::unordered_set<const Symbol*>& whole, const ScheduleRequest& request) {
  std::unordered_set<const Symbol*> excluded = whole;
  excluded.insert(chosen.store.begin(), chosen.store.end());
  if (request.makes(Decision::Slices)) compute_at_points(funcs, points, readers, excluded);
  for (const FuncPtr& f : funcs) whole.insert(f.get());
}

// So that the log tells of every Func.
void name_inlined(const std::vector<FuncPtr>& outputs, const std::vector<FuncPtr>& order) {
  for (const FuncPtr& f : order) {
    const bool is_output = std::find(outputs.begin(), outputs.end(), f) != outputs.end();
    const bool is_inlined = f->schedule.compute_level.kind == graph::LoopLevel::Kind::Inlined;
    if (is_inlined && !has_directives(*f) && f->is_pure() && !is_output) Func(f).compute_inline();
  }
}

}  // namespace

SizeEstimate give_default_schedule(const std::vector<FuncPtr>& outputs,
                                   const ScheduleRequest& request, Scheduling what) {
  const std::vector<FuncPtr> order = topological_order(outputs);
  PlacementLimits limits;
  if (what == Scheduling::Everything || has_chosen_places(request.options))
    limits = placement_limits(order);
  ChosenPlaces chosen = chosen_places(outputs, limits, request.options);
  chosen.recomputed = with_names(outputs, request.recomputed);
  if (what != Scheduling::Everything) limits = PlacementLimits();
  std::unordered_set<const Symbol*> whole = limits.stay;
  whole.insert(limits.levels.begin(), limits.levels.end());
  // Before sums are cut: what that schedules would pass for the user's.
  const FixedDimensions fixed(outputs);
  const bool may_choose = request.makes(Decision::Choices);
  std::vector<FuncPtr> stored =
      what == Scheduling::Everything
          ? stored_in_all(outputs, limits, chosen, may_choose ? &fixed : nullptr)
          : stored_by_default(outputs, chosen);
  TaskSizes tasks(order);
  SizeEstimate sizes(outputs, machine_of(request));
  whole.merge(step_sums(outputs, sizes));
  cut_sums(outputs, stored, whole, chosen, request, sizes);
  const bool slices_scatters =
      request.makes(Decision::ScatterStrategy) && request.makes(Decision::Slices);
  const SlicedScatters slices(outputs, slices_scatters ? stored : std::vector<FuncPtr>(), whole,
                              sizes);
  const LaneDimensions along(
      outputs, request.makes(Decision::LayoutStaging) ? stored : std::vector<FuncPtr>(),
      schedule_lanes, sizes);
  const RowHosts rows =
      find_row_hosts(outputs, request.makes(Decision::Slices) ? stored : std::vector<FuncPtr>(),
                     whole, chosen, slices, along, sizes);
  const PointFuncs points = find_point_funcs(
      outputs, request.makes(Decision::LayoutStaging) ? stored : std::vector<FuncPtr>(), whole,
      rows, slices, sizes);
  const AtomicScatters atomic(outputs, stored, whole, request, sizes);
  const Readers before(outputs, stored);
  std::vector<FuncPtr> given;  // loops, at root
  std::vector<FuncPtr> at_points;
  std::vector<FuncPtr> started;  // sums of these, in their tiles
  for (const FuncPtr& f : stored) {
    if (has_directives(*f)) continue;
    Func(f).compute_root();
    if (rows.contains(*f)) {
      rows.give_loops(f, [&](const FuncPtr& g, int stage, const SizeEstimate& of_row) {
        give_root_loops(g, stage, request, of_row);
      });
      continue;
    }
    if (f->is_extern() || limits.levels.contains(f.get()) || atomic.schedule(f)) continue;
    if (points.points_of(*f)) {
      give_point_loops(f, points, schedule_lanes, request.machine, sizes);
      at_points.push_back(f);
      continue;
    }
    if (request.makes(Decision::ScatterStrategy) && schedule_scatter(f, slices, sizes)) {
      if (atomic.is_part(*f)) run_serially(f);
      continue;
    }
    if (const size_t d = along.of(*f); d > 0)
      give_loops_along(f, d, request, sizes);
    else
      give_loops(f, request, sizes, started);
    if (atomic.is_part(*f))
      run_serially(f);
    else
      given.push_back(f);
  }
  rows.move();
  whole.merge(rows.all());
  move_point_funcs(at_points, points, before, chosen, whole, request);
  if (may_choose) unroll_choices(given, fixed, sizes);
  const auto give_rows = [&](const FuncPtr& sum, const std::vector<size_t>& dimensions) {
    std::erase(started, sum);
    graph::reset_loops(*sum);
    SizeEstimate of_rows = sizes;
    for (const size_t d : dimensions) of_rows = of_rows.with_extent(*sum, d, 1);
    give_loops(sum, request, of_rows, started);
  };
  const auto give_tile = [&](const FuncPtr& sum, const RegisterTile& tile) {
    std::erase(started, sum);
    graph::reset_loops(*sum);
    for (int s = 0; s < sum->stage_count(); ++s) give_loops_of_tile(sum, s, tile, request, sizes);
  };
  move_and_join({outputs, stored, given, whole, before, sizes}, request, give_rows, give_tile);
  for (const FuncPtr& f : started) start_sums(f, request, sizes);
  if (request.makes(Decision::TaskSizes)) run_rows_in_pieces(given, sizes);
  tasks.limit(outputs, request);
  name_inlined(outputs, order);
  return sizes;
}

std::vector<FuncPtr> with_large_funcs_at_root(const std::vector<FuncPtr>& outputs,
                                              const ScheduleRequest& request) {
  if (stored_by_default(outputs).empty()) return outputs;
  const std::vector<FuncPtr> result = copy_graph(outputs).outputs;
  compute_at_root(stored_by_default(result), request);
  return result;
}

}  // namespace retrograde::autoschedule
