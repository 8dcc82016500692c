// value_range.h -- bounds of the values of Funcs, and whether a value may be infinite.
//
// Elements of images, parameters and extern stages count as finite, and so do sums and products of finite numbers.
// Infinities come from constants and poles: 1 / x, log(0), an exp that overflows, the identity of a maximum over an
// empty domain. Bounds hold wherever the value is not NaN. They prove that logistic functions, softened norms and
// clamped values are finite.
//
// Without a promise (ImageParam::promise_finite) an image may hold any bits, and a strong product must cope with that.
// With it, elements of the image, and of Funcs that copy them, are known to be finite.
//
// Method: one pass over the Funcs, producers first. Updates that read their own Func are evaluated repeatedly until no
// bound grows; a bound that grows is widened to 0, then to infinity.
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
  ValueRanges() = default;  // knows nothing about any Func
  // `order` has producers before consumers. Nothing is known about Funcs outside of it.
  explicit ValueRanges(const std::vector<FuncPtr>& order);

  ValueRange of(const Expr& e) const;
  bool may_be_infinite(const Expr& e) const { return of(e).infinite; }
  // Whether `leaf` reads an ImageParam with promise_finite, or a Func that holds only elements of such images and
  // constants.
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
