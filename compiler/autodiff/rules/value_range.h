// What values Funcs can have: bounds, and whether a value may be infinite.
//
// What images, parameters and extern stages hold counts as finite, and so do sums and products of
// finite numbers. What is left are constants and poles: 1 / x, log(0), an exp that overflows, the
// identity of a maximum over an empty domain. Bounds hold wherever the value is not NaN; they prove
// that logistic functions, softened norms and what was clamped are finite.
//
// A promise (ImageParam::promise_finite) holds for what images and Funcs hold, without it that is
// "whatever was stored", which a strong product must meet.
//
// Method: one pass over the Funcs, producers first. Updates that read their own Func are evaluated
// again until nothing grows, where a bound that grows goes to 0, then to infinity.
#pragma once

#include <unordered_map>
#include <unordered_set>
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
  ValueRanges() = default;  // of no Func anything is known
  // `order`: producers before consumers. Of others nothing is known.
  explicit ValueRanges(const std::vector<FuncPtr>& order);

  ValueRange of(const Expr& e) const;
  bool may_be_infinite(const Expr& e) const { return of(e).infinite; }
  // An element of an ImageParam of which its user promises that, or of a Func that holds nothing but
  // such elements and constants.
  bool is_promised_finite(const Expr& leaf) const;

 private:
  ValueRange of_leaf(const Expr& leaf) const;
  std::vector<ValueRange> of_stage(const Definition& stage) const;
  bool only_passes_on(const Expr& value) const;
  void add(const FuncPtr& f);
  std::unordered_map<const Symbol*, std::vector<ValueRange>> funcs_;
  std::unordered_set<const Symbol*> promised_;  // Funcs
};

}  // namespace retrograde::autodiff
