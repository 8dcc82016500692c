#include "autodiff/sweeps/reverse_sweep.h"

#include <unordered_map>

#include "autodiff/rules/derivative_rules.h"
#include "autodiff/sums/distinct_nodes.h"
#include "ir/build.h"

namespace retrograde::autodiff {

namespace {

class ReverseSweep {
 public:
  ReverseSweep(const std::vector<Expr>& values, const std::vector<Expr>& seeds,
               FunctionRef<bool(const Expr&)> is_wanted, const ValueRanges& ranges)
      : values_(with_equal_nodes_shared(values)),
        order_(post_order(values_)),
        facts_(order_, is_wanted, ranges) {
    result_.notes = facts_.notes();
    for (size_t i = 0; i < values.size(); ++i) {
      if (values_[i].defined() && seeds[i].defined())
        add(values_[i], seeds[i], traits_of(seeds[i]));
    }
  }

  SweepResult run() {
    for (auto e = order_.rbegin(); e != order_.rend(); ++e) {
      auto it = adjoints_.find(e->get());
      if (it == adjoints_.end() || is_zero(it->second.sum)) continue;
      State state = it->second;
      if (is_leaf(*e)) {
        result_.leaves.push_back({*e, state.sum});
      } else {
        propagate(local_derivative(*e, facts_), state);
      }
    }
    return std::move(result_);
  }

 private:
  struct State {
    Expr sum;
    AdjointTraits traits;
  };

  void add(const Expr& e, const Expr& adjoint, const AdjointTraits& traits) {
    if (!facts_.is_active(e) || is_zero(adjoint)) return;
    Expr converted = cast_to(adjoint_type(e.type()), adjoint);
    State& state = adjoints_[e.get()];
    add_term(state.sum, converted);
    state.traits.add(traits);
  }

  void propagate(const LocalDerivative& local, const State& state) {
    switch (local.kind) {
      case LocalDerivative::Kind::Zero:
        result_.notes.insert(local.note);
        return;
      case LocalDerivative::Kind::Choice: {
        Expr zero = make_zero(state.sum.type());
        AdjointTraits traits = state.traits;
        traits.masked = true;
        add(local.operands[0], make_select(local.condition, state.sum, zero), traits);
        add(local.operands[1], make_select(local.condition, zero, state.sum), traits);
        return;
      }
      case LocalDerivative::Kind::Sum:
        for (size_t i = 0; i < local.operands.size(); ++i) add_partial(local, i, state);
        return;
    }
  }

  void add_partial(const LocalDerivative& local, size_t i, const State& state) {
    Partial partial = local.partials[i];
    if (!partial.factor.defined() || !facts_.is_active(local.operands[i])) return;
    const Finiteness& factor = local.factors[i];
    AdjointTraits traits = state.traits;
    if ((traits.masked && factor.read) || (traits.vanished && factor.infinite) ||
        (traits.levelled && factor.product))
      partial.strength = as_strong(partial.strength);
    if (traits.singular) partial.strength = as_cut(partial.strength);
    traits.add({.masked = partial.factor.as<Select>() != nullptr,
                .vanished = local.levels_off_by(i),
                .levelled = local.levels_off_by(i),
                .singular = local.poles});
    add(local.operands[i], times_partial(state.sum, partial), traits);
  }

  std::vector<Expr> values_;
  std::vector<Expr> order_;
  ExprFacts facts_;
  std::unordered_map<const ExprNode*, State> adjoints_;
  SweepResult result_;
};

}  // namespace

SweepResult sweep_reverse(const std::vector<Expr>& values, const std::vector<Expr>& seeds,
                          FunctionRef<bool(const Expr&)> is_wanted, const ValueRanges& ranges) {
  return ReverseSweep(values, seeds, is_wanted, ranges).run();
}

}  // namespace retrograde::autodiff
