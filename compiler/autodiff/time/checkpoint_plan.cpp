#include "autodiff/time/checkpoint_plan.h"

#include <algorithm>

#include "autodiff/sums/accumulation.h"
#include "autodiff/time/checkpoint_actions.h"
#include "autodiff/time/revolve.h"
#include "autodiff/updates/versions.h"
#include "diagnostics/error.h"
#include "ir/build.h"
#include "ir/print.h"
#include "simplify/simplify.h"

namespace retrograde::autodiff {

namespace {

class Planner {
 public:
  Planner(const UpdateContext& context, const TapeLayout& layout, const FuncPtr& machine)
      : c_(context), f_(context.f), layout_(layout), machine_(machine) {
    const auto& loops = c_.definition.rvars;
    plan_.time = loops.back();
    plan_.inner.assign(loops.begin(), loops.end() - 1);
    plan_.inner_count = iteration_count(plan_.inner);
    plan_.at_hand = unique_name("adjoint_at_hand");
  }

  CheckpointPlan run(const FuncPtr& adjoint) {
    plan_.steps = simplify(plan_.time.extent);
    if (auto n = as_const_int(plan_.steps)) plan_.constant_steps = static_cast<int>(*n);
    SweepResult sweep = sweep_all(adjoint);
    for (const LeafAdjoint& leaf : sweep.leaves) {
      if (as_call_of(leaf.leaf, f_)) {
        plan_.passed_on.push_back(leaf);
      } else {
        add_contribution(leaf);
      }
    }
    for (const Expr& read : c_.needed_reads(sweep)) add_needed(read);
    plan_.bytes_of_state = bytes_of_state();
    plan_.states = number_of_states();
    return std::move(plan_);
  }

 private:
  // ---- the budget ----

  int number_of_states() const {
    int64_t states = c_.query.checkpoints.states;
    if (c_.query.checkpoints.bytes > 0) states = states_in_bytes(c_.query.checkpoints.bytes);
    if (!plan_.constant_steps)
      return static_cast<int>(std::min<int64_t>(states, most_states_at_run_time));
    const int64_t steps = *plan_.constant_steps;
    states = std::min(states, steps);
    int64_t again = revolve_advances(steps, states);
    if (plan_.needs_values() && again + 4 * steps > most_rows) {
      user_error(c_.asked(), text("a schedule has at most ", most_rows, " actions"),
                 text(steps, " steps with room for ", states,
                      states == 1 ? " state recompute " : " states recompute ", again, " steps"),
                 "Give a larger budget: AdjointOptions::checkpoint_states");
    }
    return static_cast<int>(states);
  }

  std::optional<int64_t> bytes_of_state() const {
    auto elements = as_const_int(layout_.elements());
    if (!elements) return std::nullopt;
    int64_t bytes = *elements;
    const Box& box = c_.query.regions.of(f_);
    for (size_t d = 0; d < c_.pure.size(); ++d) {
      if (!c_.pure[d]) continue;
      auto extent = constant_extent(box[d]);
      if (!extent) return std::nullopt;
      bytes *= *extent;
    }
    return bytes * total_bytes(plan_.types);
  }

  int64_t states_in_bytes(int64_t budget) const {
    auto bytes = plan_.bytes_of_state;
    if (!bytes) {
      user_error(c_.asked(), "a budget in bytes needs to know the size of a state",
                 text("an extent of ", quoted(f_->name), " is known at run time only"),
                 "Give a number of states: AdjointOptions::checkpoint_states");
    }
    if (*bytes > budget) {
      user_error(
          c_.asked(), "the budget must have room for one state, the first",
          text("a state of ", quoted(f_->name), " has ", *bytes, " bytes, the budget is ", budget),
          text("Give at least ", *bytes, " bytes"));
    }
    return *bytes > 0 ? budget / *bytes : 1;
  }

  // ---- one step ----

  SweepResult sweep_all(const FuncPtr& adjoint) {
    AdjointTraits& traits = machine_->made->traits;
    if (adjoint->made) traits.add(adjoint->made->traits);
    traits.masked = true;
    choose_types({});
    choose_types(c_.sweep_iterations(machine_, [&] { return seeds(); }).leaves);
    return c_.sweep(seeds());
  }

  // Chooses types that hold values of f and adjoints exactly. Floating-point types are those of the adjoints; the first
  // is as wide as the widest sum.
  void choose_types(const std::vector<LeafAdjoint>& leaves) {
    plan_.types.clear();
    for (size_t k = 0; k < f_->types.size(); ++k) {
      bool floating = f_->types[k].is_float();
      if (floating && plan_.sum_value < 0) plan_.sum_value = static_cast<int>(k);
      plan_.types.push_back(floating ? c_.query.target.types[k] : f_->types[k]);
    }
    Type& widest = plan_.types[static_cast<size_t>(plan_.sum_value)];
    for (const LeafAdjoint& leaf : leaves) {
      if (leaf.adjoint.type().bits() > widest.bits()) widest = leaf.adjoint.type();
    }
    machine_->types = plan_.types;
  }

  std::vector<Expr> seeds() const {
    std::vector<Expr> result = c_.adjoints_at(machine_, layout_.with_pure(variable(plan_.at_hand)));
    for (size_t k = 0; k < result.size(); ++k) {
      if (result[k].defined()) result[k] = cast_to(c_.query.target.types[k], result[k]);
    }
    return result;
  }

  void add_contribution(const LeafAdjoint& leaf) {
    const Expr& predicate = c_.domain.predicate;
    CheckpointPlan::StepContribution contribution;
    contribution.leaf = leaf;
    contribution.over_time = predicate.defined() && uses_variable(predicate, plan_.time.var);
    for_each_child(leaf.leaf, [&](const Expr& index) {
      contribution.over_time |= uses_variable(index, plan_.time.var);
      if (!calls(index, f_)) return;
      unsupported(
          c_.asked(), "a checkpointed loop forgets the values that its steps saw",
          text("an index of ", ir::print(leaf.leaf), " depends on values of ", quoted(f_->name)),
          "Leave out the budget and pass AdjointOptions{.overwritten = "
          "Overwritten::Store}");
    });
    contribution.compensated =
        !contribution.over_time && plan_.constant_steps.value_or(many_terms) >= many_terms;
    plan_.contributions.push_back(contribution);
  }

  void add_needed(const Expr& read) {
    plan_.needed.push_back(read);
    plan_.place_of.push_back(place_number(plan_.places, as_call_of(read, f_)->args));
  }

  const UpdateContext& c_;
  FuncContents* f_;
  const TapeLayout& layout_;
  const FuncPtr& machine_;
  CheckpointPlan plan_;
};

}  // namespace

CheckpointPlan plan_checkpoints(const UpdateContext& context, const TapeLayout& layout,
                                const FuncPtr& adjoint, const FuncPtr& machine) {
  return Planner(context, layout, machine).run(adjoint);
}

}  // namespace retrograde::autodiff
