#include "autodiff/time/checkpoint.h"

#include <algorithm>
#include <optional>

#include "autodiff/time/checkpoint_actions.h"
#include "autodiff/time/checkpoint_step.h"
#include "autodiff/updates/versions.h"
#include "frontend/language/var.h"
#include "graph/definitions/define.h"
#include "ir/build.h"
#include "ir/print.h"
#include "simplify/simplify.h"

namespace retrograde::autodiff {

namespace {

class CheckpointedLoop {
 public:
  CheckpointedLoop(const UpdateContext& context, UpdateAdjoint& result)
      : c_(context),
        f_(context.f),
        result_(result),
        layout_(context),
        machine_(make_func(Role::Checkpoints, f_->name + "_checkpoints", f_->name)) {}

  void run() {
    plan_ = plan_checkpoints(c_, layout_, result_.current.func, machine_);
    table_ = make_table();
    if (table_.computed_by) result_.helpers.push_back(table_.computed_by);
    slots_.emplace(c_, layout_, plan_, machine_);
    define_machine();
    record_ = record_writes(c_, plan_, *slots_);
    adjoint_ = adjoint_writes(c_, plan_, *slots_);
    append_loop();
    note_work();
    hand_over();
  }

 private:
  ActionTable make_table() const {
    if (!plan_.needs_values()) return reversals_alone(plan_.steps);
    if (plan_.constant_steps) return action_table(*plan_.constant_steps, plan_.states);
    return action_table(plan_.steps, plan_.states, claim_name(f_->name + "_actions"));
  }

  void define_machine() {
    FuncPtr before = clone_prefix(c_.query.f, c_.query.stage);
    Expr slot = layout_.slot(), elements = layout_.elements();
    std::vector<Expr> initial;
    for (size_t k = 0; k < plan_.types.size(); ++k) {
      Type type = plan_.types[k];
      Expr zero = make_zero(type), adjoint = zero;
      int index = static_cast<int>(k);
      if (f_->types[k].is_float()) {
        Expr a = call_value(result_.current.func, layout_.element(slot - elements), index);
        adjoint = make_select(slot < elements * 2, cast_to(type, a), zero);
      }
      Expr value = cast_to(type, call_value(before, layout_.element(slot), index));
      initial.push_back(make_select(slot < elements, value, adjoint));
    }
    machine_->types.clear();  // set again by the definition
    define_pure(machine_, layout_.with_pure(slot), initial);
    append(result_.helpers, {before, machine_});
  }

  // ---- the loop over actions ----

  struct Branch {
    Expr is_chosen, runs;
    SlotWrite write;
  };

  void append_loop() {
    const DomainPtr rdom = make_domain();
    Expr write = add_loop(rdom, "write", make_zero(Int(32)), writes_per_iteration());
    for (const ReductionVariable& r : plan_.inner) {
      forward_[r.var] = add_loop(rdom, r.var, r.min, r.extent);
      backward_[r.var] = mirrored(r, forward_[r.var]);
    }
    Expr row = add_loop(rdom, "action", make_zero(Int(32)), table_.rows);
    Expr step = clamp(table_.entry(1, row), 0, plan_.steps - 1);
    forward_[plan_.time.var] = backward_[plan_.time.var] = plan_.time.min + step;
    forward_[plan_.at_hand] = backward_[plan_.at_hand] = slots_->at_hand();

    std::vector<ReductionVariable> pass(rdom->vars.begin(), rdom->vars.end() - 1);
    Expr number = substitute(iteration_number(pass), names_of(pass, rdom));
    Branch all = one_of(branches(table_.entry(0, row), write, number,
                                 clamp(table_.entry(2, row), 0, std::max(plan_.states - 1, 0))));
    append_update(machine_, layout_.with_pure(clamp(all.write.place, 0, slots_->count() - 1)),
                  all.write.values, rdom->vars, all.runs);
  }
  static Substitution names_of(const std::vector<ReductionVariable>& loops, const DomainPtr& rdom) {
    Substitution names;
    for (const ReductionVariable& r : loops) names[r.var] = loop_variable(rdom, r.var);
    return names;
  }
  // Copies of states use the same loops, which must cover all elements.
  Expr writes_per_iteration() const {
    Expr most = make_const(Int(32), static_cast<int>(std::max(record_.size(), adjoint_.size())));
    if (!plan_.needs_values()) return most;
    Expr inner = max(plan_.inner_count, 1);
    return simplify(max(most, (layout_.elements() + inner - 1) / inner));
  }

  // `write`: the number of the write within the iteration. `number`: the number of the write within the pass.
  std::vector<Branch> branches(const Expr& action, const Expr& write, const Expr& number,
                               const Expr& slot) const {
    auto is = [&](Action a) { return action == static_cast<int>(a); };
    auto within = [&](const std::vector<SlotWrite>& writes) {
      return write < static_cast<int>(writes.size());
    };
    Expr written = placed(layout_.is_inside(c_.write), backward_);
    std::vector<Branch> result{{is(Action::Adjoint),
                                has_run(backward_) && written && within(adjoint_),
                                chosen(adjoint_, write, backward_)}};
    if (!plan_.needs_values()) {
      result.push_back({const_true(), const_false(), result[0].write});
      return result;
    }
    result.push_back({is(Action::Record), has_run(forward_) && within(record_),
                      chosen(record_, write, forward_)});
    result.push_back(
        {is(Action::Advance), has_run(forward_) && write == 0, placed(record_.back(), forward_)});
    Expr in_state = number < layout_.elements();
    Expr element = clamp(number, 0, layout_.elements() - 1);
    Expr kept = slots_->kept() + slot * layout_.elements() + element;
    result.push_back({is(Action::Store), in_state, {kept, slots_->all_values(element)}});
    result.push_back({is(Action::Restore), in_state, {element, slots_->all_values(kept)}});
    if (table_.computed_by) result.push_back({const_true(), const_false(), result.back().write});
    return result;
  }
  Expr has_run(const Substitution& places) const {
    return c_.domain.predicate.defined() ? placed(c_.domain.predicate, places) : const_true();
  }

  static Branch one_of(const std::vector<Branch>& branches) {
    Branch all = branches.back();
    for (size_t i = branches.size() - 1; i-- > 0;) {
      const Branch& b = branches[i];
      all.runs = choose_step(b.is_chosen, b.runs, all.runs);
      all.write = choose(b.is_chosen, b.write, all.write);
    }
    return all;
  }
  SlotWrite chosen(const std::vector<SlotWrite>& writes, const Expr& write,
                   const Substitution& places) const {
    SlotWrite result = placed(writes.back(), places);
    for (size_t i = writes.size() - 1; i-- > 0;)
      result = choose(write == static_cast<int>(i), placed(writes[i], places), result);
    return result;
  }
  static SlotWrite choose(const Expr& condition, const SlotWrite& a, const SlotWrite& b) {
    SlotWrite result{choose_step(condition, a.place, b.place), {}};
    for (size_t k = 0; k < a.values.size(); ++k)
      result.values.push_back(choose_step(condition, a.values[k], b.values[k]));
    return result;
  }
  Expr placed(const Expr& e, const Substitution& places) const {
    return with_values(substitute(e, places), c_.query.f, {});
  }
  SlotWrite placed(const SlotWrite& w, const Substitution& places) const {
    return {placed(w.place, places),
            mapped(w.values, [&](const Expr& v) { return placed(v, places); })};
  }

  // ---- contributions to other Funcs ----

  void note_work() {
    const std::vector<Expr> inner = mapped(plan_.inner, &ReductionVariable::extent);
    auto note = [&](const std::vector<SlotWrite>& writes, Action action, std::vector<Expr> loops) {
      loops.push_back(table_.count(action));
      machine_->made->work.push_back(work_of(writes, machine_, std::move(loops)));
    };
    note(adjoint_, Action::Adjoint, inner);
    if (!plan_.needs_values()) return;
    note(record_, Action::Record, inner);
    note({record_.back()}, Action::Advance, inner);
    SlotWrite copy{make_zero(Int(32)), slots_->all_values(layout_.slot())};
    note({copy}, Action::Store, {layout_.elements()});
    note({copy}, Action::Restore, {layout_.elements()});
  }

  void hand_over() {
    std::vector<Expr> before;
    Expr inside = layout_.is_inside(c_.point);
    for (size_t k = 0; k < plan_.types.size(); ++k) {
      Expr a = f_->types[k].is_float()
                   ? slots_->adjoint_at(slots_->adjoint(layout_.slot_of(c_.point)), k)
                   : make_zero(c_.query.target.types[k]);
      before.push_back(make_select(inside, a, make_zero(a.type())));
    }
    result_.previous = c_.adjoint_before(before);
    for (size_t i = 0; i < plan_.contributions.size(); ++i) {
      const CheckpointPlan::StepContribution& g = plan_.contributions[i];
      Expr slot = slots_->contribution(i), sum = slots_->sum_at(slot);
      if (g.compensated) sum = sum + slots_->sum_at(slot + 1);
      result_.direct.push_back({{g.leaf.leaf, cast_to(g.leaf.adjoint.type(), sum)},
                                g.over_time ? c_.domain : one_step()});
    }
    explain_schedule();
  }
  IterationDomain one_step() const {
    IterationDomain domain = c_.domain;
    std::erase_if(domain.vars, [&](const LoopVariable& v) { return v.name == plan_.time.var; });
    return domain;
  }

  void explain_schedule() {
    std::string what = "its partials need no values of it, so no state is kept";
    if (plan_.needs_values())
      what = text("from ", kept_text(), ", ", again_text(), " recomputed beside the ",
                  ir::print(plan_.steps), " that are reversed");
    c_.note(text(" is a loop of ", ir::print(plan_.steps), " steps that ", quoted(machine_->name),
                 " runs backward: ", what),
            result_);
  }
  std::string kept_text() const {
    const auto& bytes = plan_.bytes_of_state;
    return text(plan_.states, plan_.states == 1 ? " kept state" : " kept states",
                bytes ? text(" of ", *bytes, " bytes") : std::string());
  }
  std::string again_text() const {
    if (plan_.constant_steps) return text(ir::print(table_.count(Action::Advance)), " steps");
    return text("each step at most r times, as ", quoted(table_.computed_by->name),
                " finds at run time,");
  }

  const UpdateContext& c_;
  FuncContents* f_;
  UpdateAdjoint& result_;
  TapeLayout layout_;
  FuncPtr machine_;
  CheckpointPlan plan_;
  ActionTable table_;
  std::optional<CheckpointSlots> slots_;
  std::vector<SlotWrite> record_,
      adjoint_;                      // one iteration of a step, in terms of its own variables
  Substitution forward_, backward_;  // from its variables to the loop's
};

}  // namespace

bool wants_checkpoints(const UpdateContext& c) {
  if (!c.query.checkpoints.is_set() || c.definition.rvars.empty()) return false;
  auto steps = as_const_int(simplify(c.definition.rvars.back().extent));
  return !steps || *steps > 0;
}

void differentiate_by_checkpoints(const UpdateContext& context, UpdateAdjoint& result) {
  CheckpointedLoop(context, result).run();
}

}  // namespace retrograde::autodiff
