// Sums are brought to linear form first, so that cancelling variables disappear; then each atom has
// a rule.
#include "analysis/monotonic.h"

#include "analysis/linear.h"
#include "ir/build.h"
#include "ir/node_memo.h"
#include "ir/visit.h"

namespace retrograde::analysis {
namespace {

Monotonic reversed(Monotonic m) {
  if (m == Monotonic::Increasing) return Monotonic::Decreasing;
  return m == Monotonic::Decreasing ? Monotonic::Increasing : m;
}

// For an operation that increases in both operands.
Monotonic both(Monotonic a, Monotonic b) {
  if (a == Monotonic::Constant) return b;
  return b == Monotonic::Constant || a == b ? a : Monotonic::Unknown;
}

class Direction {
 public:
  explicit Direction(const std::string& variable) : variable_(variable) {}

  Monotonic of(const Expr& e) {
    return memo_.get(e, [&] { return has_linear_form(e.type()) ? of_sum(e) : of_atom(e); });
  }

 private:
  const std::string& variable_;
  NodeMemo<Monotonic> memo_;

  Monotonic of_sum(const Expr& e) {
    const Sum form = linear_form(e);
    Monotonic result = Monotonic::Constant;
    for (const Term& term : form.terms) {
      Monotonic part = term.atom.same_as(e) ? of_atom(e) : of_term(term.atom);
      result = both(result, term.factor < 0 ? reversed(part) : part);
    }
    return result;
  }

  // Atoms of linear_form are not decomposed again.
  Monotonic of_term(const Expr& atom) {
    return memo_.get(atom, [&] { return of_atom(atom); });
  }

  Monotonic of_atom(const Expr& e) {
    return match(
        e,
        [&](const Variable& v) {
          return v.name == variable_ ? Monotonic::Increasing : Monotonic::Constant;
        },
        [&](const Cast& n) { return of_cast(n); },
        [&](const Binary& n) { return of_binary(e.kind(), n); },
        [&](const Select& n) {
          Monotonic arms = both(of(n.when_true), of(n.when_false));
          return of(n.condition) == Monotonic::Constant ? arms : Monotonic::Unknown;
        },
        [&](const Call& n) { return of_call(e, n); },
        [&](const ExprNode&) { return constant_or_unknown(e); });
  }

  Monotonic constant_or_unknown(const Expr& e) const {
    // The contents of a Func may change from one iteration to the next.
    const bool reads = any_node(
        e, [](const Call& call) { return call.call_type == CallType::Func; },
        [](const Load&) { return true; });
    const bool is_constant = !reads && !uses_variable(e, variable_);
    return is_constant ? Monotonic::Constant : Monotonic::Unknown;
  }

  Monotonic of_cast(const Cast& n) {
    Monotonic value = of(n.value);
    bool keeps_order = n.type.can_represent(n.value.type());
    return keeps_order || value == Monotonic::Constant ? value : Monotonic::Unknown;
  }

  Monotonic of_binary(Kind kind, const Binary& n) {
    Monotonic a = of(n.a), b = of(n.b);
    if (a == Monotonic::Constant && b == Monotonic::Constant) return a;
    auto sign = as_const_int(n.b);
    switch (kind) {
      case Kind::Min:
      case Kind::Max:
        return both(a, b);
      case Kind::Mul:
      case Kind::Div:
        if (!sign || *sign == 0 || !has_linear_form(n.type)) return Monotonic::Unknown;
        return *sign > 0 ? a : reversed(a);
      default:
        return Monotonic::Unknown;
    }
  }

  Monotonic of_call(const Expr& e, const Call& n) {
    if (n.is_likely()) return of(n.args[0]);
    if (n.is_op(Op::promise_clamped, Op::unsafe_promise_clamped))
      return both(of(n.args[0]), both(of(n.args[1]), of(n.args[2])));
    return constant_or_unknown(e);
  }
};

}  // namespace

Monotonic monotonic(const Expr& e, const std::string& variable) {
  return Direction(variable).of(e);
}

}  // namespace retrograde::analysis
