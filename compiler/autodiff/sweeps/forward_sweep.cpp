#include "autodiff/sweeps/forward_sweep.h"

#include <unordered_map>

#include "diagnostics/error.h"
#include "ir/build.h"

namespace retrograde::autodiff {

namespace {

class ForwardSweep {
 public:
  ForwardSweep(const std::vector<Expr>& values, FunctionRef<Expr(const Expr&)> tangent_of,
               const ValueRanges& ranges)
      : order_(post_order(values)),
        tangent_of_(tangent_of),
        facts_(
            order_, [&](const Expr& leaf) { return tangent_of(leaf).defined(); }, ranges) {
    result_.notes = facts_.notes();
  }

  ForwardResult run(const std::vector<Expr>& values) {
    for (const Expr& e : order_) visit(e);
    for (const Expr& value : values) {
      result_.tangents.push_back(value.defined() ? tangent(value) : Expr());
      result_.moves |= result_.tangents.back().defined() && facts_.is_active(value);
      if (value.defined()) result_.traits.add(traits_[value.get()]);
    }
    return std::move(result_);
  }

 private:
  Expr tangent(const Expr& e) const { return value_or(tangents_, e.get(), {}); }

  void visit(const Expr& e) {
    if (as_op(e, Op::undef)) {
      if (e.type().is_float()) tangents_[e.get()] = call_op(Op::undef, adjoint_type(e.type()), {});
      undefs_.insert(e.get());
      return;
    }
    note_undef(e);
    if (is_leaf(e)) {
      if (!facts_.is_active(e)) return;
      tangents_[e.get()] = cast_to(adjoint_type(e.type()), tangent_of_(e));
      traits_[e.get()] = traits_of(tangents_[e.get()]);
      // The tangent of a Func may have overflowed, as its value may.
      const auto* call = e.as<Call>();
      traits_[e.get()].infinite |= call && call->call_type == CallType::Func;
    } else if (e.type().is_float() && (facts_.is_active(e) || undefs_.contains(e.get()))) {
      Expr t = combine(e, local_derivative(e, facts_));
      if (t.defined()) tangents_[e.get()] = t;
    }
  }

  // An undef that keeps the old value must keep the old tangent, too. That is supported for selects only.
  void note_undef(const Expr& e) {
    bool below = false;
    for_each_child(e, [&](const Expr& child) { below |= undefs_.contains(child.get()); });
    if (!below) return;
    undefs_.insert(e.get());
    const auto* choice = e.as<Select>();
    if (choice && !undefs_.contains(choice->condition.get())) return;
    unsupported("differentiate a value that is undef in places",
                "the tangent of undef is known where a select chooses it and nothing else is done "
                "with it",
                "an operator takes a value that may be undef",
                "Make the select with undef the outermost operation of the definition, or say "
                "where it stores with RDom::where");
  }

  Expr combine(const Expr& e, const LocalDerivative& local) {
    Type type = adjoint_type(e.type());
    switch (local.kind) {
      case LocalDerivative::Kind::Zero:
        result_.notes.insert(local.note);
        return {};
      case LocalDerivative::Kind::Choice: {
        Expr a = tangent(local.operands[0]), b = tangent(local.operands[1]);
        passed_[e.get()].choice = true;
        for (const Expr& operand : local.operands)
          passed_[e.get()].quotient |= passed_[operand.get()].quotient;
        for (const Expr& operand : local.operands) traits_[e.get()].add(traits_[operand.get()]);
        if (!a.defined() && !b.defined()) return {};
        return make_select(local.condition, a.defined() ? a : make_zero(type),
                           b.defined() ? b : make_zero(type));
      }
      case LocalDerivative::Kind::Sum:
        break;
    }
    Expr sum;
    for (size_t i = 0; i < local.operands.size(); ++i) {
      Expr t = tangent(local.operands[i]);
      if (!t.defined() || !local.partials[i].factor.defined()) continue;
      Expr term = cast_to(type, times_partial(t, partial_of(local, i, e)));
      if (is_zero(term)) continue;
      add_term(sum, term);
    }
    return sum;
  }

  // Returns partial i with the strength that the operand's tangent requires, and records the consequences in e's
  // traits. A tangent meets the partials in the opposite order to an adjoint: where the adjoint would be 0 before it
  // reaches an infinite partial, the tangent has already passed that partial and must be cut.
  Partial partial_of(const LocalDerivative& local, size_t i, const Expr& e) {
    Partial partial = local.partials[i];
    const Finiteness& factor = local.factors[i];
    const AdjointTraits& passed = traits_[local.operands[i].get()];
    const Passed here = passed_[local.operands[i].get()];
    const bool is_quotient = partial.divisor.defined();
    if (factor.infinite || (here.choice && factor.read))
      partial.strength = as_strong(partial.strength);
    if (passed.singular || (passed.infinite && local.levels_off_by(i)) ||
        (here.quotient && !is_quotient))
      partial.strength = as_cut(partial.strength);
    passed_[e.get()].choice |= here.choice || partial.factor.as<Select>();
    passed_[e.get()].quotient |= here.quotient || is_quotient;
    AdjointTraits& traits = traits_[e.get()];
    traits.add(passed);
    const bool may_overflow = factor.risky || factor.infinite || factor.product || factor.read;
    traits.add({.singular = local.poles, .infinite = may_overflow});
    return partial;
  }

  std::vector<Expr> order_;
  FunctionRef<Expr(const Expr&)> tangent_of_;
  ExprFacts facts_;
  std::unordered_set<const ExprNode*> undefs_;
  std::unordered_map<const ExprNode*, Expr> tangents_;
  std::unordered_map<const ExprNode*, AdjointTraits> traits_;
  // Operations that a tangent passed within this expression. They may have made it 0 or, though the value is finite,
  // infinite.
  struct Passed {
    bool choice = false;
    bool quotient = false;  // division by, or logarithm of, a possibly denormal number
  };
  std::unordered_map<const ExprNode*, Passed> passed_;
  ForwardResult result_;
};

}  // namespace

ForwardResult sweep_forward(const std::vector<Expr>& values,
                            FunctionRef<Expr(const Expr&)> tangent_of, const ValueRanges& ranges) {
  return ForwardSweep(values, tangent_of, ranges).run(values);
}

}  // namespace retrograde::autodiff
