// What values Funcs can have: bounds, and whether a value may be infinite.
//
// What images, parameters and extern stages hold counts as finite, and so do sums and products of
// finite numbers. What is left are constants and poles: 1 / x, log(0), an exp that overflows, the
// identity of a maximum over an empty domain. Bounds hold wherever the value is not NaN; they prove
// that logistic functions, softened norms and what was clamped are finite.
//
// Method: one pass over the Funcs, producers first. Updates that read their own Func are evaluated
// again until nothing grows, where a bound that grows goes to 0, then to infinity.
#pragma once

#include <unordered_map>
#include <vector>

#include "graph/function.h"
#include "ir/interval.h"

namespace retrograde::autodiff {

struct ValueRange : IntervalOf<double> {
  bool infinite = false;  // -inf if `min` is -inf, inf if `max` is inf
  bool operator==(const ValueRange& other) const = default;
};

class ValueRanges {
 public:
  // `order`: producers before consumers. Of others nothing is known.
  explicit ValueRanges(const std::vector<FuncPtr>& order);

  ValueRange of(const Expr& e) const;
  bool may_be_infinite(const Expr& e) const { return of(e).infinite; }

 private:
  ValueRange of_leaf(const Expr& leaf) const;
  std::vector<ValueRange> of_stage(const Definition& stage) const;
  void add(const FuncPtr& f);
  std::unordered_map<const Symbol*, std::vector<ValueRange>> funcs_;
};

}  // namespace retrograde::autodiff
