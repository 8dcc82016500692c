// reduction_lanes -- a reduction runs in vectors of its terms, inside of the loops over elements.
//
//   parallel y:16, r.x, vector y     =>     parallel y, r.x:16, vector r.x     a vector of partial results
//                                    =>     parallel y, r.x:64, vector r.x     four of them hide the latency of a sum
//
// Legal: L4: a step of as many terms as there are lanes stands outside. L2 doesn't hold: the update is a sum, product,
// minimum or maximum, so terms may be added in any order, and chains of additions become shorter. Lanes depend on the
// program alone, so results have the same bits for every number of threads.
// Lanes along the variable whose terms lie together in memory are given.
#include <algorithm>

#include "autoschedule/access/plain_reduction.h"
#include "autoschedule/moves/edit.h"

namespace retrograde::planning::moves {

namespace {

constexpr int64_t vectors_of_sums = 4;

bool takes_any_order(const Context& context, StageId stage) {
  const graph::FuncContents& f = *context.accesses.func(stage.func).func;
  return stage.stage > 0 && is_plain_reduction(f, f.stage(stage.stage)) &&
         context.dependences.commutes(stage);
}

// The reduction variable whose terms lie together best, of those with enough terms; -1: there is none.
int lanes_along(const StageLoops& loops, const Nest& plain) {
  int best = -1;
  const auto terms = [&](int i) {
    const auto depth = static_cast<int>(innermost_loop(plain, i));
    return points_inside(loops.extents, plain, depth - 1, i);
  };
  for (int i = 0; i < static_cast<int>(loops.extents.size()); ++i) {
    if (!is_reduction(loops.context, loops.stage, i) ||
        lanes_for(loops.plan, loops.stage, terms(i)) == 1)
      continue;
    const auto rank = [&](int iterator) {
      return lanes_together(loops.context, loops.stage, iterator);
    };
    if (best < 0 || rank(i) > rank(best)) best = i;
  }
  return best;
}

std::vector<Nest> vectors_of_terms(const StageLoops& loops) {
  const auto& [plan, context, stage, nest, extents] = loops;
  if (nest.concurrency != Concurrency::Independent || !takes_any_order(context, stage)) return {};
  std::optional<Nest> terms = without_body(nest, context, stage);
  const int along = terms ? lanes_along(loops, *terms) : -1;
  if (along < 0) return {};
  terms->concurrency = Concurrency::Racing;
  std::ranges::stable_sort(terms->loops, {}, [&](const Loop& loop) {
    return loop.iterator == along ? 2 : is_reduction(loops.context, loops.stage, loop.iterator);
  });
  const auto depth = static_cast<int>(innermost_loop(*terms, along));
  const int64_t points = points_inside(extents, *terms, depth - 1, along);
  int64_t lanes = lanes_for(plan, stage, points);
  if (!fits(lanes, points)) lanes /= 2;
  std::vector<Nest> nests;
  for (const int64_t n : {lanes, vectors_of_sums * lanes}) {
    if (!fits(n, points)) continue;
    run_inside(nests.emplace_back(*terms), along, n, ForType::Vectorized);
  }
  return nests;
}

}  // namespace

std::vector<Plan> reduction_lanes(const Plan& plan, FuncId func, const Context& context) {
  return with_nests(plan, func, context, vectors_of_terms, Terms::InAnyOrder);
}

}  // namespace retrograde::planning::moves
