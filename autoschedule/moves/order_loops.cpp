// order_loops -- other orders of the loops around a stage's body, which are the loops at its end that are unrolled or lanes.
//
//   r.x, y, x:16, vector x     =>     y, x:16, r.x, vector x       rows as they are stored, the reduction inside
//                              =>     r.x, y, x:16, vector x       the reduction outside
//                              =>     x:16, y, r.x, vector x       across rows
//
// Legal: L1, L2. Loops of the reduction keep their order among each other, so each element takes its terms in the same
// order; iterations of pure loops never meet. Parallel loops stay outside. A nest that has two loops of an iterator keeps
// the order of its pure loops, which makes its tiles.
#include <algorithm>
#include <functional>
#include <set>

#include "autoschedule/moves/edit.h"

namespace retrograde::planning::moves {

namespace {

enum class Reduction : uint8_t { Inside, Outside };

class LoopOrder {
 public:
  explicit LoopOrder(const StageLoops& loops)
      : nest_(loops.nest), stage_(loops.stage), context_(loops.context) {
    end_ = body_depth(nest_);
    begin_ = std::min(shared_loops(loops.plan, stage_), end_);
    while (begin_ < end_ && nest_.loops[begin_].kind == ForType::Parallel) ++begin_;
    std::set<int16_t> seen;
    for (size_t d = begin_; d < end_; ++d)
      is_tiled_ = !seen.insert(nest_.loops[d].iterator).second || is_tiled_;
    const std::vector<int16_t>& order = loops.plan.of(stage_.func).storage.order;
    for (const Iterator& i : context_.accesses.stage(stage_).iterators) {
      const bool is_pure = i.kind == Iterator::Kind::Pure;
      ranks_.push_back(is_pure ? std::ranges::find(order, i.dimension) - order.begin() : 0);
    }
  }
  std::vector<Nest> run() const {
    std::vector<Nest> nests{ordered(Reduction::Inside, true), ordered(Reduction::Outside, true)};
    if (!is_tiled_) nests.push_back(ordered(Reduction::Inside, false));
    return nests;
  }

 private:
  Nest ordered(Reduction reduction, bool along_rows) const {
    const auto key = [&](const Loop& loop) {
      const auto iterator = static_cast<size_t>(loop.iterator);
      if (is_reduction(context_, stage_, loop.iterator))
        return std::pair(reduction == Reduction::Inside ? 1 : -1, std::ptrdiff_t{0});
      if (is_tiled_) return std::pair(0, std::ptrdiff_t{0});
      return std::pair(0, along_rows ? -ranks_[iterator] : ranks_[iterator]);
    };
    Nest nest = nest_;
    const auto first = nest.loops.begin();
    std::ranges::stable_sort(first + static_cast<std::ptrdiff_t>(begin_),
                             first + static_cast<std::ptrdiff_t>(end_), std::less(), key);
    return nest;
  }

  const Nest& nest_;
  const StageId stage_;
  const Context& context_;
  size_t begin_ = 0, end_ = 0;  // the loops that are ordered
  bool is_tiled_ = false;
  std::vector<std::ptrdiff_t> ranks_;  // by iterator: of the dimension in memory
};

std::vector<Nest> orders(const StageLoops& loops) { return LoopOrder(loops).run(); }

}  // namespace

std::vector<Plan> order_loops(const Plan& plan, FuncId func, const Context& context) {
  return with_nests(plan, func, context, orders);
}

}  // namespace retrograde::planning::moves
