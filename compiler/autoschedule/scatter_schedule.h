// scatter_schedule.h -- loops and layout of sums at places that data decide.
//
//   f(i(r), j(r), c) += term(r, c)
//
// A place is the same for all values of c, the dimensions that are no scatter's. Where these are
// many, they are the lanes of vectors: f has them innermost in memory, so that a place takes one
// load, one addition and one store, and the place itself is computed once for all of them. Where
// they are few, a vector holds iterations; lowering adds its elements in order.
// Taps: a loop whose variable only picks one of a few places is unrolled around each iteration or
// vector of iterations, which share what their places and terms have in common.
// Every order is fixed, and with it every bit, whatever the number of threads.
#pragma once

#include <optional>
#include <vector>

#include "autoschedule/size_estimate.h"
#include "frontend/schedule/stage.h"
#include "graph/function.h"

namespace retrograde::autoschedule {

// Taps of one loop: it is unrolled.
inline constexpr int most_taps = 16;

struct ScatterLanes {
  size_t dimension;
  int width;
};

// The dimension that is worth vectors, of a Func whose updates scatter along others.
std::optional<ScatterLanes> scatter_lanes(const FuncContents& f, const SizeEstimate& sizes);
// Dimensions each of whose values has places of its own.
std::vector<size_t> dimensions_apart(const FuncContents& f, const ScatterLanes& lanes);
// All of f, computed at root, or slice by slice in loops that run in parallel.
void schedule_scatter_lanes(const FuncPtr& f, const ScatterLanes& lanes, const SizeEstimate& sizes,
                            bool in_slices = false);

// Parts of a scatter, laid out for its lanes, are summed as they lie: the layout of the parts, but the
// number of the part, for a Func that adds them up and nothing else.
//
//   sum(x, y, c) += parts(x, y, c, part)      for y, x: for part: for c in vectors
std::optional<std::vector<size_t>> layout_of_parts(const FuncContents& f);
// All of f, computed at root, with its dimensions innermost first.
void schedule_sum_of_parts(const FuncPtr& f, const std::vector<size_t>& layout,
                           const SizeEstimate& sizes);

// The parts that an update adds to its own element, number after number; null: it does something else.
FuncPtr parts_of_sum(const FuncContents& f, const Definition& update);

// Whether an update adds to places that data decide.
bool is_scatter(const FuncContents& f, const Definition& update);
// Loops whose values pick one of a few places, and all others.
std::vector<VarOrRVar> loops_of_taps(const Definition& update);
std::vector<VarOrRVar> loops_but_taps(const Definition& update);

// Whether the stage adds to places that data decide, along the first dimension too, over a loop that
// is worth vectors of iterations. Short loops inside of it are unrolled.
bool scatters_in_order(const FuncContents& f, const Definition& stage);
void schedule_scatter_in_order(const FuncContents& f, int index, Stage& stage);

// Elsewhere: one sweep for each tap, which then knows its place.
void unroll_taps(const Definition& update, Stage& stage);

}  // namespace retrograde::autoschedule
