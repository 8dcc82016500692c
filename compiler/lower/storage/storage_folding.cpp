#include "lower/storage/storage_folding.h"

#include <algorithm>

#include "analysis/monotonic.h"
#include "diagnostics/error.h"
#include "ir/build.h"
#include "ir/markers.h"
#include "ir/visit.h"
#include "simplify/simplify.h"

namespace retrograde::lower {
namespace {

constexpr int64_t largest_fold = 1024;

class Folder {
 public:
  Folder(const LoopedFunc& f, const std::vector<Slide>& slides, const std::vector<Loop>& around,
         bool is_vectorized)
      : f_(f),
        slides_(slides),
        facts_(facts_with_early_iterations(around, slides)),
        is_vectorized_(is_vectorized),
        folds_(f.func->args.size()) {}

  std::vector<Fold> over(const std::vector<FoldingLoop>& loops) {
    for (auto it = loops.rbegin(); it != loops.rend(); ++it) {
      bool hands_on = std::ranges::any_of(
          slides_, [&](const Slide& slide) { return slide.loop.name == it->loop.name; });
      for (int d = static_cast<int>(folds_.size()) - 1; d >= 0; d--) fold(d, *it, hands_on);
      if (hands_on) break;
    }
    return folds_;
  }

 private:
  const LoopedFunc& f_;
  const std::vector<Slide>& slides_;
  const BoundsMap facts_;
  const bool is_vectorized_;
  std::vector<Fold> folds_;

  // Before a loop's first iteration, windows that depend on both y / 2 and y are wider.
  static BoundsMap facts_with_early_iterations(const std::vector<Loop>& around,
                                               const std::vector<Slide>& slides) {
    BoundsMap facts = facts_of(around);
    for (const Slide& slide : slides) {
      Interval& range = facts[slide.loop.name];
      if (range.min.defined()) range.min = simplify(range.min - slide.lead);
    }
    return facts;
  }

  Expr asked_factor(int d) const {
    for (const StorageRule& rule : f_.schedule.storage_rules) {
      if (rule.var == f_.func->args[d]) return rule.fold;
    }
    return {};
  }

  bool is_innermost(int d) const {
    const std::vector<std::string>& order = f_.schedule.storage_dims;
    return order.empty() ? d == 0 : order[0] == f_.func->args[d];
  }

  static bool moves_one_way(const Interval& window, const std::string& loop) {
    Monotonic min = monotonic(window.min, loop), max = monotonic(window.max, loop);
    return min != Monotonic::Unknown && max != Monotonic::Unknown &&
           (min == max || min == Monotonic::Constant || max == Monotonic::Constant);
  }

  void fold(int d, const FoldingLoop& at, bool hands_on) {
    const Interval& window = at.window[d];
    if (folds_[d].factor.defined() || !window.is_bounded()) return;
    const std::string& loop = at.loop.name;
    if (!uses_variable(window.min, loop) && !uses_variable(window.max, loop)) return;
    if (hands_on && !moves_one_way(window, loop)) return;
    const Expr extent = ir::without_promises(without_likely(window.max - window.min + 1));
    Expr touched = simplify(extent, facts_);
    if (Expr asked = asked_factor(d); asked.defined()) {
      bool fits = can_prove(touched <= asked, facts_);
      folds_[d] = {asked, fits ? Expr() : touched};
    } else if (!f_.schedule.async && !f_.schedule.memoized &&
               !(is_vectorized_ && is_innermost(d))) {
      folds_[d].factor = smallest_power_of_two(touched);
    }
  }

  Expr smallest_power_of_two(const Expr& touched) const {
    auto constant = as_const_int(touched);
    for (int64_t factor = 1; factor <= largest_fold; factor *= 2) {
      if (constant ? *constant <= factor
                   : can_prove(touched <= make_const(Int(32), factor), facts_))
        return make_const(Int(32), factor);
    }
    return {};
  }
};

}  // namespace

std::vector<Fold> folds_of(const LoopedFunc& f, const std::vector<FoldingLoop>& loops,
                           const std::vector<Slide>& slides, const std::vector<Loop>& around,
                           bool is_vectorized) {
  return Folder(f, slides, around, is_vectorized).over(loops);
}

}  // namespace retrograde::lower
