#include "testing/schedules/tails.h"

#include <algorithm>
#include <functional>

namespace retrograde::fuzz {

namespace {

// Whether the loop covers a dimension of an output whose extents all pass the test. Other Funcs have no extents to fit.
bool holds_for_output(const Loop& loop, const StageContext& stage,
                      const std::function<bool(int)>& test) {
  if (stage.output_extents.empty()) return true;
  if (loop.dimension < 0) return false;
  const std::vector<int>& extents = stage.output_extents[loop.dimension];
  return std::all_of(extents.begin(), extents.end(), test);
}

}  // namespace

TailStrategy random_tail(const Loop& loop, int factor, const StageContext& stage, Choices& random) {
  std::vector<TailStrategy> legal = {TailStrategy::GuardWithIf, TailStrategy::GuardWithIf,
                                     TailStrategy::Predicate};
  if (loop.is_reduction) {
    legal.push_back(TailStrategy::Auto);
    return random.pick(legal);
  }
  const bool inside_output = !stage.output_extents.empty();
  if (!loop.is_original && (inside_output || stage.is_update)) return random.pick(legal);
  const bool fits = holds_for_output(loop, stage, [&](int extent) { return extent >= factor; });
  const bool divides =
      holds_for_output(loop, stage, [&](int extent) { return extent % factor == 0; });
  if (fits && !stage.is_update) legal.push_back(TailStrategy::ShiftInwards);
  if (stage.is_update ? divides : fits) legal.push_back(TailStrategy::Auto);
  if (divides) {
    legal.insert(legal.end(), {TailStrategy::RoundUp, TailStrategy::RoundUp});
    if (loop.is_original) {
      legal.insert(legal.end(), {TailStrategy::PredicateLoads, TailStrategy::PredicateStores});
    }
  }
  return random.pick(legal);
}

}  // namespace retrograde::fuzz
