// Slots of a tape: the elements of a Func beside its pure dimensions, numbered in storage order.
#pragma once

#include <vector>

#include "autodiff/updates/numbering.h"
#include "autodiff/updates/versions.h"

namespace retrograde::autodiff {

// place <- values
struct SlotWrite {
  Expr place;
  std::vector<Expr> values;
};
// What the writes of an iteration of `func` do, in so many iterations; `map`: of what they say.
AdjointWork work_of(const std::vector<SlotWrite>& writes, const FuncPtr& func,
                    std::vector<Expr> loops, ExprMap map = same_expr);

class TapeLayout {
 public:
  // Throws Unsupported when a dimension that is not pure has no bounds.
  explicit TapeLayout(const UpdateContext& context);

  Expr slot() const { return slot_; }          // the variable of the tape's last dimension
  Expr elements() const { return elements_; }  // number of slots that are elements
  // The same, as a lower bound: unknown extents count as one.
  double least_elements() const { return least_product(extents_); }
  // The pure variables, then `slot`: a point of a tape.
  std::vector<Expr> with_pure(const Expr& slot) const;
  // The element at `args`; where it lies outside of the Func's region, the nearest one inside.
  Expr slot_of(const std::vector<Expr>& args) const;
  // Whether `args` lies in the region, beside the pure dimensions.
  Expr is_inside(const std::vector<Expr>& args) const;
  // Coordinates of element `number`, or of the nearest one there is.
  std::vector<Expr> element(const Expr& number) const;

 private:
  bool is_always_inside(const Expr& index, size_t d) const;
  const UpdateContext& c_;
  const Box& box_;
  Expr slot_, elements_;
  std::vector<Expr> extents_, strides_;  // per dimension; undefined in pure ones
  Scope<Interval> scope_;                // ranges of the update's variables
};

}  // namespace retrograde::autodiff
