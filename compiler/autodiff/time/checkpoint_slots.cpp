#include "autodiff/time/checkpoint_slots.h"

#include "autodiff/updates/numbering.h"
#include "autodiff/updates/versions.h"
#include "frontend/language/expr_ops.h"
#include "ir/build.h"
#include "simplify/simplify.h"

namespace retrograde::autodiff {

CheckpointSlots::CheckpointSlots(const UpdateContext& context, const TapeLayout& layout,
                                 const CheckpointPlan& plan, const FuncPtr& machine)
    : c_(context), layout_(layout), plan_(plan), machine_(machine) {
  check_numbers(c_, least_slots(), "the slots of a loop with checkpoints");
  at_hand_ = simplify(layout_.elements() * 2);
  noted_ = simplify(at_hand_ + 1);
  Expr next = noted_ + plan_.inner_count * static_cast<int>(plan_.places.size());
  for (const CheckpointPlan::StepContribution& g : plan_.contributions) {
    contributions_.push_back(simplify(next));
    next = next + plan_.inner_count * (g.over_time ? plan_.steps : g.width());
  }
  kept_ = simplify(next);
  Expr states = plan_.needs_values() ? Expr(plan_.states) : make_zero(Int(32));
  if (!plan_.constant_steps) states = min(states, max(plan_.steps, 1));
  count_ = simplify(kept_ + layout_.elements() * states);
}

double CheckpointSlots::least_slots() const {
  const double inner = least_iterations(plan_.inner);
  double states = 2 + (plan_.needs_values() && plan_.constant_steps ? plan_.states : 0);
  double slots = layout_.least_elements() * states + 1;
  slots += inner * static_cast<double>(plan_.places.size());
  for (const CheckpointPlan::StepContribution& g : plan_.contributions)
    slots += inner * (g.over_time ? plan_.constant_steps.value_or(1) : g.width());
  return slots;
}

Expr CheckpointSlots::adjoint(const Expr& element) const { return element + layout_.elements(); }

Expr CheckpointSlots::note(size_t place) const {
  return noted_ + iteration_number(plan_.inner) * static_cast<int>(plan_.places.size()) +
         static_cast<int>(place);
}

Expr CheckpointSlots::contribution(size_t i) const {
  const CheckpointPlan::StepContribution& g = plan_.contributions[i];
  if (g.over_time) return contributions_[i] + iteration_number(c_.definition.rvars);
  return contributions_[i] + iteration_number(plan_.inner) * g.width();
}

Expr CheckpointSlots::at(const Expr& slot, size_t k) const {
  return call_value(machine_, layout_.with_pure(slot), static_cast<int>(k));
}
Expr CheckpointSlots::value_at(const Expr& slot, size_t k) const {
  return cast_to(c_.f->types[k], at(slot, k));
}
Expr CheckpointSlots::adjoint_at(const Expr& slot, size_t k) const {
  return cast_to(c_.query.target.types[k], at(slot, k));
}
Expr CheckpointSlots::sum_at(const Expr& slot) const {
  return at(slot, static_cast<size_t>(plan_.sum_value));
}
std::vector<Expr> CheckpointSlots::all_values(const Expr& slot) const {
  return values_of(machine_, layout_.with_pure(slot));
}

}  // namespace retrograde::autodiff
