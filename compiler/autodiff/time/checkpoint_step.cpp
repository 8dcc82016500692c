#include "autodiff/time/checkpoint_step.h"

#include "frontend/language/expr_ops.h"
#include "ir/build.h"

namespace retrograde::autodiff {

namespace {

class CheckpointStep {
 public:
  CheckpointStep(const UpdateContext& context, const CheckpointPlan& plan,
                 const CheckpointSlots& slots)
      : c_(context), f_(context.f), plan_(plan), slots_(slots), elements_(slots.elements()) {}

  std::vector<SlotWrite> forward() const {
    std::vector<SlotWrite> writes;
    for (size_t i = 0; i < plan_.places.size(); ++i) {
      Expr from = in_state(elements_.slot_of(plan_.places[i]));
      writes.push_back({slots_.note(i), slots_.all_values(from)});
    }
    SlotWrite last{in_state(elements_.slot_of(c_.write)), {}};
    Expr inside = in_state(elements_.is_inside(c_.write));
    for (size_t k = 0; k < plan_.types.size(); ++k) {
      Expr value = cast_to(plan_.types[k], in_state(c_.values[k]));
      last.values.push_back(make_select(inside, value, slots_.at(last.place, k)));
    }
    writes.push_back(last);
    return writes;
  }

  std::vector<SlotWrite> backward() const {
    Expr written = slots_.adjoint(noted(elements_.slot_of(c_.write)));
    std::vector<SlotWrite> writes{{slots_.at_hand(), slots_.all_values(written)}, {written, {}}};
    for (Type t : plan_.types) writes[1].values.push_back(make_zero(t));
    pass_on(writes);
    for (size_t i = 0; i < plan_.contributions.size(); ++i) append_contribution(i, writes);
    return writes;
  }

 private:
  // Reads of f become reads of the current state.
  Expr in_state(const Expr& e) const {
    return map_calls_of(e, f_, [&](const Call& call, const std::vector<Expr>& args) {
      return slots_.value_at(elements_.slot_of(args), static_cast<size_t>(call.component));
    });
  }
  // Reads of f become reads of the values that the step stored.
  Expr noted(const Expr& e) const {
    return rewrite(e, [&](const Expr& node, const auto& recurse) -> Expr {
      const Call* call = as_call_of(node, f_);
      for (size_t i = 0; call && i < plan_.needed.size(); ++i) {
        if (equal(plan_.needed[i], node))
          return slots_.value_at(slots_.note(plan_.place_of[i]),
                                 static_cast<size_t>(call->component));
      }
      return map_children(node, recurse);
    });
  }

  void pass_on(std::vector<SlotWrite>& writes) const {
    std::vector<std::vector<Expr>> places{c_.write};  // places of the writes after the first
    for (const LeafAdjoint& leaf : plan_.passed_on) {
      const Call* call = as_call_of(leaf.leaf, f_);
      const size_t i = place_number(places, call->args) + 1;
      if (i == writes.size()) {
        Expr slot = slots_.adjoint(noted(elements_.slot_of(call->args)));
        writes.push_back({slot, slots_.all_values(slot)});
      }
      size_t k = static_cast<size_t>(call->component);
      Expr term = make_select(noted(elements_.is_inside(call->args)), noted(leaf.adjoint),
                              make_zero(leaf.adjoint.type()));
      Type type = c_.query.target.types[k];
      Expr& value = writes[i].values[k];
      value = cast_to(plan_.types[k], cast_to(type, value) + cast_to(type, term));
    }
  }

  void append_contribution(size_t i, std::vector<SlotWrite>& writes) const {
    const CheckpointPlan::StepContribution& g = plan_.contributions[i];
    Expr slot = slots_.contribution(i), old = slots_.sum_at(slot);
    Expr term = cast_to(old.type(), noted(g.leaf.adjoint));
    auto write = [&](const Expr& place, const Expr& value) {
      writes.push_back({place, slots_.all_values(place)});
      writes.back().values[static_cast<size_t>(plan_.sum_value)] = value;
    };
    if (g.over_time) return write(slot, term);
    if (!g.compensated) return write(slot, old + term);
    // The exact rounding error of old + term: D. Knuth, The Art of Computer Programming 2, section 4.2.2, theorem B.
    term = exactly(term);
    Expr sum = exactly(old + term), from_term = exactly(sum - old);
    Expr lost = exactly(exactly(old - exactly(sum - from_term)) + exactly(term - from_term));
    write(slot + 1, exactly(slots_.sum_at(slot + 1) + lost));
    write(slot, sum);
  }
  static Expr exactly(const Expr& e) { return call_op(Op::strict_float, e.type(), {e}); }

  const UpdateContext& c_;
  FuncContents* f_;
  const CheckpointPlan& plan_;
  const CheckpointSlots& slots_;
  const TapeLayout& elements_;
};

}  // namespace

std::vector<SlotWrite> record_writes(const UpdateContext& context, const CheckpointPlan& plan,
                                     const CheckpointSlots& slots) {
  return CheckpointStep(context, plan, slots).forward();
}

std::vector<SlotWrite> adjoint_writes(const UpdateContext& context, const CheckpointPlan& plan,
                                      const CheckpointSlots& slots) {
  return CheckpointStep(context, plan, slots).backward();
}

}  // namespace retrograde::autodiff
