// vectorise -- lanes along another iterator, or none.
//
//   y, x:16, vector x     =>     y:16, x, vector y      and      y, x
//
// Legal: L1: iterations of pure loops never meet, and those of a reduction are lanes only if they don't; L4: a step of as
// many points as there are lanes stands outside. Lanes of a sum stay: removing them would make its chains of additions longer.
#include <algorithm>

#include "autoschedule/moves/edit.h"

namespace retrograde::planning::moves {

namespace {

constexpr size_t most_iterators = 3;

std::vector<Nest> with_lanes(const StageLoops& loops) {
  const auto& [plan, context, stage, nest, extents] = loops;
  const std::optional<Nest> plain = without_body(nest, context, stage);
  if (!plain) return {};
  std::vector<int> iterators;
  for (int i = 0; i < static_cast<int>(extents.size()); ++i) {
    if (find_loop(*plain, i, 1)) iterators.push_back(i);
  }
  std::ranges::stable_sort(iterators, std::greater(),
                           [&](int i) { return lanes_together(loops.context, loops.stage, i); });
  std::vector<Nest> nests;
  for (const int i : iterators) {
    if (nests.size() == most_iterators) break;
    const auto depth = static_cast<int>(innermost_loop(*plain, i));
    const int64_t lanes = lanes_for(plan, stage, points_inside(extents, *plain, depth - 1, i));
    if (lanes == 1) continue;
    Nest along = *plain;
    run_inside(along, i, lanes, ForType::Vectorized);
    if (may_run_at_once(context, stage, along, along.loops.size() - 1))
      nests.push_back(std::move(along));
  }
  nests.push_back(*plain);
  return nests;
}

}  // namespace

std::vector<Plan> vectorise(const Plan& plan, FuncId func, const Context& context) {
  return with_nests(plan, func, context, with_lanes);
}

}  // namespace retrograde::planning::moves
