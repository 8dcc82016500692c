#include "autodiff/carried_sums.h"

#include <algorithm>
#include <cmath>

#include "autodiff/accumulation.h"
#include "autodiff/versions.h"
#include "ir/build.h"

namespace retrograde::ir {

namespace {

// A node that is linear in what is carried: a product with `factor` (undefined: 1), a quotient, a
// sum, a choice.
struct Linear {
  enum class Kind { Carried, Scaled, Divided, Sum, Choice, Unknown } kind = Kind::Unknown;
  std::vector<Expr> parts;  // those that may hold what is carried
  Expr factor;              // or divisor, or condition
};

Linear scaled(const Expr& a, const Expr& b, const FuncContents* carried) {
  if (calls(a, carried) && calls(b, carried)) return {};
  bool first = calls(a, carried);
  return {Linear::Kind::Scaled, {first ? a : b}, first ? b : a};
}

Linear linear_operator(const Call& n, const FuncContents* carried) {
  if (n.call_type != CallType::Operator) return {};
  if (n.op == Op::strong_mul) return scaled(n.args[0], n.args[1], carried);
  if (n.op == Op::strong_div && !calls(n.args[1], carried))
    return {Linear::Kind::Divided, {n.args[0]}, n.args[1]};
  return {};
}

Linear as_linear(const Expr& e, const FuncContents* carried) {
  using Kind = Linear::Kind;
  if (as_call_of(e, carried)) return {Kind::Carried, {}, {}};
  return match(
      e,
      [&](const Add& n) {
        return Linear{Kind::Sum, {n.a, n.b}, {}};
      },
      [&](const Sub& n) {
        return Linear{Kind::Sum, {n.a, n.b}, {}};
      },
      [&](const Mul& n) { return scaled(n.a, n.b, carried); },
      [&](const Div& n) {
        return calls(n.b, carried) ? Linear{} : Linear{Kind::Divided, {n.a}, n.b};
      },
      [&](const Select& n) {
        return calls(n.condition, carried)
                   ? Linear{}
                   : Linear{Kind::Choice, {n.true_value, n.false_value}, n.condition};
      },
      [&](const Cast& n) {
        return n.value.type().is_float() && n.type.is_float() ? Linear{Kind::Scaled, {n.value}, {}}
                                                              : Linear{};
      },
      [&](const Call& n) { return linear_operator(n, carried); },
      [&](const ExprNode&) { return Linear{}; });
}

std::optional<double> magnitude(const Expr& factor) {
  if (!factor.defined()) return 1;
  auto value = as_const_float(factor);
  return value ? std::optional(std::fabs(*value)) : std::nullopt;
}

}  // namespace

std::optional<double> carried_factor(const Expr& term, const FuncContents* carried) {
  if (!calls(term, carried)) return 0;
  Linear n = as_linear(term, carried);
  if (n.kind == Linear::Kind::Carried) return 1;
  if (n.kind == Linear::Kind::Unknown) return std::nullopt;
  double sum = 0, largest = 0;
  for (const Expr& part : n.parts) {
    auto factor = carried_factor(part, carried);
    if (!factor) return std::nullopt;
    sum += *factor;
    largest = std::max(largest, *factor);
  }
  if (n.kind == Linear::Kind::Choice) return largest;
  if (n.kind == Linear::Kind::Sum) return sum;
  auto factor = magnitude(n.factor);
  if (!factor) return std::nullopt;
  return n.kind == Linear::Kind::Scaled ? sum * *factor : sum / *factor;
}

bool carries_sums(const std::vector<Expr>& terms, const FuncContents* carried) {
  double sum = 0;
  for (const Expr& term : terms) {
    auto factor = carried_factor(term, carried);
    if (!factor) return true;
    sum += *factor;
  }
  // The terms that are remembered are a geometric series: 1 / (1 - sum) of them count.
  return !(sum <= 1 - 1.0 / many_carried);
}

Expr carried_in_double(const Expr& term, const FuncPtr& rounded, const FuncPtr& exact) {
  const Type wide = Float(64);
  if (!calls(term, rounded.get())) return cast_to(wide, term);
  auto part = [&](const Expr& e) { return carried_in_double(e, rounded, exact); };
  Linear n = as_linear(term, rounded.get());
  switch (n.kind) {
    case Linear::Kind::Carried: {
      const Call* call = as_call_of(term, rounded.get());
      return call_value(exact, call->args, call->value_index);
    }
    case Linear::Kind::Choice:
      return make_select(n.factor, part(n.parts[0]), part(n.parts[1]));
    case Linear::Kind::Unknown:
      return cast_to(wide, rewrite(term, [&](const Expr& node, const auto& recurse) -> Expr {
                       const Call* call = as_call_of(node, rounded.get());
                       if (!call) return map_children(node, recurse);
                       return cast_to(call->type, call_value(exact, call->args, call->value_index));
                     }));
    default:
      break;
  }
  if (term.as<Cast>()) return part(n.parts[0]);
  const auto* call = term.as<Call>();
  return call ? call_op(call->op, wide, {part(call->args[0]), part(call->args[1])})
              : map_children(term, part);
}

}  // namespace retrograde::ir
