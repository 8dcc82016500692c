// checkpoint_slots.h -- the slots of a checkpointed Func, which is one array beside its pure dimensions:
//
//   [ state P | adjoint P | a | values of one step | sums | kept states ]
#pragma once

#include <vector>

#include "autodiff/time/checkpoint_plan.h"

namespace retrograde::autodiff {

class CheckpointSlots {
 public:
  // `machine` is the Func with these slots.
  CheckpointSlots(const UpdateContext& context, const TapeLayout& layout,
                  const CheckpointPlan& plan, const FuncPtr& machine);

  const TapeLayout& elements() const { return layout_; }
  const Expr& count() const { return count_; }
  // The first slot of each section. The state starts at 0.
  const Expr& at_hand() const { return at_hand_; }
  const Expr& kept() const { return kept_; }
  Expr adjoint(const Expr& element) const;
  // The slot of the value noted for a place, in the current iteration of the inner loops.
  Expr note(size_t place) const;
  // The slot of contribution i of the plan, in the current iteration.
  Expr contribution(size_t i) const;

  // The content of a slot: as it is; as a value of f; as its adjoint; as a sum.
  Expr at(const Expr& slot, size_t k) const;
  Expr value_at(const Expr& slot, size_t k) const;
  Expr adjoint_at(const Expr& slot, size_t k) const;
  Expr sum_at(const Expr& slot) const;
  std::vector<Expr> all_values(const Expr& slot) const;

 private:
  double least_slots() const;
  const UpdateContext& c_;
  const TapeLayout& layout_;
  const CheckpointPlan& plan_;
  FuncPtr machine_;
  Expr at_hand_, noted_, kept_, count_;
  std::vector<Expr> contributions_;
};

}  // namespace retrograde::autodiff
