#include "autodiff/sums/carried_sums.h"

#include <algorithm>
#include <cmath>

#include "autodiff/sums/generated_definitions.h"
#include "graph/definitions/own_reads.h"
#include "ir/build.h"
#include "ir/node_memo.h"

namespace retrograde::autodiff {

namespace {

// A node that is linear in the carried value: a product with `factor` (undefined: 1), a quotient, a sum or a select.
struct Linear {
  enum class Kind { Carried, Scaled, Divided, Sum, Choice, Unknown } kind = Kind::Unknown;
  std::vector<Expr> parts;  // operands that may contain the carried value
  Expr factor;              // the factor, divisor or condition
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
                   : Linear{Kind::Choice, {n.when_true, n.when_false}, n.condition};
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

// Terms share nodes, so each node is visited once.
class Factors {
 public:
  explicit Factors(const FuncContents* carried) : carried_(carried) {}

  std::optional<double> of(const Expr& term) {
    return known_.get(
        term, [&] { return calls(term, carried_) ? of_linear(as_linear(term, carried_)) : 0; });
  }

 private:
  std::optional<double> of_linear(const Linear& n) {
    if (n.kind == Linear::Kind::Carried) return 1;
    if (n.kind == Linear::Kind::Unknown) return std::nullopt;
    double sum = 0, largest = 0;
    for (const Expr& part : n.parts) {
      auto factor = of(part);
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

  const FuncContents* carried_;
  NodeMemo<std::optional<double>> known_;
};

class InDouble {
 public:
  InDouble(const FuncPtr& rounded, const FuncPtr& exact) : rounded_(rounded), exact_(exact) {}

  Expr of(const Expr& term) {
    return known_.get(
        term, [&] { return calls(term, rounded_.get()) ? of_linear(term) : cast_to(wide, term); });
  }

 private:
  static constexpr Type wide = Float(64);

  Expr of_linear(const Expr& term) {
    const Linear n = as_linear(term, rounded_.get());
    switch (n.kind) {
      case Linear::Kind::Carried: {
        const Call* call = as_call_of(term, rounded_.get());
        return call_value(exact_, call->args, call->component);
      }
      case Linear::Kind::Choice:
        return make_select(n.factor, of(n.parts[0]), of(n.parts[1]));
      case Linear::Kind::Unknown:
        return cast_to(wide, of_exact(term));
      default:
        break;
    }
    if (term.as<Cast>()) return of(n.parts[0]);
    const auto* call = term.as<Call>();
    return call ? call_op(call->op, wide, {of(call->args[0]), of(call->args[1])})
                : map_children(term, [&](const Expr& part) { return of(part); });
  }

  // The term in its own type, reading the exact values.
  Expr of_exact(const Expr& term) const {
    return map_calls_of(term, rounded_.get(), [&](const Call& call, const std::vector<Expr>&) {
      return cast_to(call.type, call_value(exact_, call.args, call.component));
    });
  }

  const FuncPtr &rounded_, &exact_;
  NodeMemo<Expr> known_;
};

}  // namespace

std::optional<double> carried_factor(const Expr& term, const FuncContents* carried) {
  return Factors(carried).of(term);
}

bool carries_sums(const std::vector<Expr>& terms, const FuncContents* carried) {
  double sum = 0;
  for (const Expr& term : terms) {
    auto factor = carried_factor(term, carried);
    if (!factor) return true;
    sum += *factor;
  }
  // The sum over remembered terms is a geometric series, which effectively has 1 / (1 - sum) terms.
  return !(sum <= 1 - 1.0 / many_carried);
}

Expr carried_in_double(const Expr& term, const FuncPtr& rounded, const FuncPtr& exact) {
  return InDouble(rounded, exact).of(term);
}

}  // namespace retrograde::autodiff
