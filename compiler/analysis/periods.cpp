// The period of an expression e of Int(32) in v is the smallest P with e(v + P) = e(v) + step for a constant step. It
// follows from the periods of the operands.
#include "analysis/periods.h"

#include <cmath>
#include <numeric>
#include <optional>

#include "ir/build.h"
#include "ir/visit.h"

namespace retrograde::analysis {

namespace {

// e(v + period) = e(v) + step
struct Growth {
  int64_t period = 1, step = 0;
};

int64_t step_over(const Growth& g, int64_t period) { return g.step * (period / g.period); }

// nullopt: the period is too long.
std::optional<Growth> checked(const Growth& g) {
  constexpr int64_t largest = int64_t{1} << 31;
  const bool fits = g.period <= longest_period && std::abs(g.step) < largest;
  return fits ? std::optional(g) : std::nullopt;
}

std::optional<Growth> scaled(const Growth& g, std::optional<int64_t> factor) {
  constexpr int64_t largest = int64_t{1} << 31;
  if (!factor || std::abs(*factor) >= largest) return std::nullopt;
  return checked({g.period, g.step * *factor});
}

std::optional<Growth> divided(const Growth& g, std::optional<int64_t> divisor, bool is_quotient) {
  if (!divisor || *divisor <= 0 || *divisor > longest_period) return std::nullopt;
  const int64_t repeats = *divisor / std::gcd(g.step, *divisor);
  return checked({g.period * repeats, is_quotient ? g.step * repeats / *divisor : 0});
}

std::optional<Growth> growth(const Expr& e, const std::string& v);

std::optional<Growth> growth_of_operation(const Binary& n, const std::string& v) {
  const auto a = growth(n.a, v), b = growth(n.b, v);
  if (!a || !b) return std::nullopt;
  const int64_t both = std::lcm(a->period, b->period);
  switch (n.kind) {
    case Kind::Add:
      return checked({both, step_over(*a, both) + step_over(*b, both)});
    case Kind::Sub:
      return checked({both, step_over(*a, both) - step_over(*b, both)});
    case Kind::Mul:
      return as_const_int(n.b) ? scaled(*a, as_const_int(n.b)) : scaled(*b, as_const_int(n.a));
    case Kind::Div:
    case Kind::Mod:
      return divided(*a, as_const_int(n.b), n.kind == Kind::Div);
    default:
      return std::nullopt;
  }
}

std::optional<Growth> growth(const Expr& e, const std::string& v) {
  if (!uses_variable(e, v)) return Growth{};
  if (e.type() != Int(32)) return std::nullopt;
  if (e.as<Variable>()) return Growth{1, 1};
  if (const auto* call = e.as<Call>())
    return call->is_marker() ? growth(call->args[0], v) : std::nullopt;
  const auto* n = e.as<Binary>();
  return n ? growth_of_operation(*n, v) : std::nullopt;
}

}  // namespace

int64_t period_in(const Expr& e, const std::string& variable) {
  int64_t period = 1;
  walk(e, [&](const Expr& node) {
    const bool divides = node.kind() == Kind::Div || node.kind() == Kind::Mod;
    if (!divides || !node.type().is_int() || !uses_variable(node, variable)) return period > 0;
    const auto found = growth(node, variable);
    period = found ? std::lcm(period, found->period) : 0;
    if (period > longest_period) period = 0;
    return false;
  });
  return period;
}

std::optional<int64_t> growth_over(const Expr& e, const std::string& variable, int64_t period) {
  const auto found = growth(e, variable);
  return found && period % found->period == 0 ? std::optional(step_over(*found, period))
                                              : std::nullopt;
}

}  // namespace retrograde::analysis
