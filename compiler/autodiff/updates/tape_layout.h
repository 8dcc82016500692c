// tape_layout.h -- the slots of a tape: the elements of a Func beside its pure dimensions, numbered in storage order.
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
// The work of the writes of an iteration of `func` in loops of these extents. `map` is applied to the expressions.
AdjointWork work_of(const std::vector<SlotWrite>& writes, const FuncPtr& func,
                    std::vector<Expr> loops, ExprMap map = same_expr);

class TapeLayout {
 public:
  // Throws Unsupported if a dimension that is not pure has no bounds.
  explicit TapeLayout(const UpdateContext& context);

  Expr slot() const { return slot_; }          // variable of the tape's last dimension
  Expr elements() const { return elements_; }  // number of slots that hold elements
  // A lower bound of elements(): unknown extents count as one.
  double least_elements() const { return least_product(extents_); }
  // A point of a tape: the pure variables, then `slot`.
  std::vector<Expr> with_pure(const Expr& slot) const;
  // The slot of the element at `args`. Outside of the Func's region it is the slot of the nearest element inside.
  Expr slot_of(const std::vector<Expr>& args) const;
  // Whether `args` lies in the region, ignoring pure dimensions.
  Expr is_inside(const std::vector<Expr>& args) const;
  // Coordinates of element `number`, or of the nearest element.
  std::vector<Expr> element(const Expr& number) const;

 private:
  bool is_always_inside(const Expr& index, size_t d) const;
  const UpdateContext& c_;
  const Box& box_;
  Expr slot_, elements_;
  std::vector<Expr> extents_, strides_;  // for each dimension; undefined for pure ones
  Scope<Interval> scope_;                // ranges of the update's variables
};

}  // namespace retrograde::autodiff
