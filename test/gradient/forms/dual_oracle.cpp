#include "gradient/forms/dual_oracle.h"

#include <cmath>
#include <limits>
#include <random>
#include <unordered_map>

#if defined(RETROGRADE_HAS_QUADMATH)
#include <quadmath.h>
#endif

#include "autodiff/sums/distinct_nodes.h"
#include "autodiff/sweeps/local_derivative.h"
#include "diagnostics/error.h"
#include "ir/build.h"
#include "ir/visit.h"

namespace retrograde::gradient {

namespace {

using ir::Kind;
using ir::Op;

#if defined(__SIZEOF_FLOAT128__) && defined(RETROGRADE_HAS_QUADMATH)
#define RETROGRADE_WIDE(name) name##q
#else
#define RETROGRADE_WIDE(name) name##l
#endif
Wide size_of(Wide v) { return v < 0 ? -v : v; }

struct Dual {
  Wide v = 0;
  std::array<Wide, leaf_count> d{};
};

// The error bound of one operation, in units in the last place.
constexpr double units = 4;
constexpr int trials = 8;

// A bound on the error of each node's value.
using Spread = std::unordered_map<const ir::ExprNode*, Wide>;

class Evaluation {
 public:
  // epsilon: the rounding error to simulate; 0 for the true gradient.
  Evaluation(const std::vector<Expr>& order, const Place& at, double epsilon, uint64_t seed)
      : order_(order), at_(at), epsilon_(epsilon), random_(seed) {}
  // Takes values from `exact`; partials see them anywhere within `spread`.
  Evaluation(const Evaluation& exact, const Spread& spread, double epsilon, uint64_t seed)
      : order_(exact.order_),
        at_(exact.at_),
        epsilon_(epsilon),
        random_(seed),
        exact_(&exact),
        spread_(&spread) {}

  // Returns false if a value is not finite, or leaves the normal range of its type.
  bool run() {
    for (const Expr& e : order_) {
      Dual result = value_of(e);
      if (exact_) result.v = exact_->of(e).v;
      if (e.type().is_float() && !is_normal(result, e.type())) return false;
      values_[e.get()] = result;
    }
    return true;
  }
  const Dual& of(const Expr& e) const { return values_.at(e.get()); }
  void widen(Spread& spread, const Evaluation& exact) const {
    for (const Expr& e : order_) {
      Wide& most = spread[e.get()];
      most = std::max(most, size_of(of(e).v - exact.of(e).v));
    }
  }

 private:
  static bool is_normal(const Dual& value, Type type) {
    const double least = type.bits() == 64 ? 1e-290 : 1e-30,
                 most = type.bits() == 64 ? 1e290 : 1e30;
    const auto fits = [&](Wide v) { return size_of(v) < static_cast<Wide>(most); };
    for (const Wide& d : value.d) {
      if (!fits(d)) return false;
    }
    return value.v == 0 || (fits(value.v) && size_of(value.v) > static_cast<Wide>(least));
  }

  double uniform() { return static_cast<double>(random_() >> 11) * 0x1p-52 - 1; }
  Wide nudge() { return epsilon_ == 0 ? 1 : 1 + static_cast<Wide>(epsilon_ * uniform()); }
  // A value as an operation reads it.
  Dual operand(const Expr& e) {
    Dual result = of(e);
    if (spread_) result.v += spread_->at(e.get()) * static_cast<Wide>(uniform());
    return result;
  }

  // Applies an operation with the value v and the given partials by its operands.
  Dual combine(Wide v, const std::vector<std::pair<const Dual*, Wide>>& partials, bool is_exact) {
    Dual result;
    result.v = is_exact ? v : v * nudge();
    for (const auto& [operand, partial] : partials) {
      for (size_t k = 0; k < leaf_count; ++k) {
        const Wide slope = operand->d[k];
        if (slope != 0 && partial != 0) result.d[k] += slope * partial * nudge();
      }
    }
    return result;
  }

  Dual value_of(const Expr& e) {
    if (const auto* v = e.as<ir::Variable>()) return leaf(static_cast<size_t>(v->name[0] - 'x'));
    if (const auto constant = ir::as_const_float(e)) return {static_cast<Wide>(*constant), {}};
    if (const auto* b = e.as<ir::Binary>()) return binary(e.kind(), operand(b->a), operand(b->b));
    if (const auto* s = e.as<ir::Select>())
      return operand(s->condition).v != 0 ? operand(s->when_true) : operand(s->when_false);
    if (const auto* call = e.as<ir::Call>()) return operation(*call);
    internal_error("the oracle of forms does not know this node");
  }
  Dual leaf(size_t k) const {
    Dual result{static_cast<Wide>(at_[k]), {}};
    result.d[k] = 1;
    return result;
  }

  Dual binary(Kind kind, const Dual& a, const Dual& b) {
    switch (kind) {
      case Kind::Add:
        return combine(a.v + b.v, {{&a, 1}, {&b, 1}}, false);
      case Kind::Sub:
        return combine(a.v - b.v, {{&a, 1}, {&b, -1}}, a.v == 0);
      case Kind::Mul:
        return combine(a.v * b.v, {{&a, b.v}, {&b, a.v}}, false);
      case Kind::Div:
        return combine(a.v / b.v, {{&a, 1 / b.v}, {&b, -a.v / b.v / b.v}}, false);
      case Kind::Max:
        return a.v >= b.v ? a : b;
      case Kind::Min:
        return a.v <= b.v ? a : b;
      case Kind::GT:
        return {static_cast<Wide>(a.v > b.v), {}};
      case Kind::LT:
        return {static_cast<Wide>(a.v < b.v), {}};
      default:
        internal_error("the oracle of forms does not know this operator");
    }
  }

  Dual operation(const ir::Call& call) {
    const Dual a = operand(call.args[0]);
    const Wide x = a.v;
    switch (call.op) {
      case Op::abs:
        return combine(size_of(x), {{&a, static_cast<Wide>(x > 0) - static_cast<Wide>(x < 0)}},
                       true);
      case Op::exp: {
        const Wide v = RETROGRADE_WIDE(exp)(x);
        return combine(v, {{&a, v}}, false);
      }
      case Op::log:
        return combine(RETROGRADE_WIDE(log)(x), {{&a, 1 / x}}, false);
      case Op::sqrt: {
        const Wide v = RETROGRADE_WIDE(sqrt)(x);
        return combine(v, {{&a, 1 / (2 * v)}}, false);
      }
      case Op::sin:
        return combine(RETROGRADE_WIDE(sin)(x), {{&a, RETROGRADE_WIDE(cos)(x)}}, false);
      case Op::tanh: {
        const Wide v = RETROGRADE_WIDE(tanh)(x), c = RETROGRADE_WIDE(cosh)(x);
        return combine(v, {{&a, 1 / (c * c)}}, false);
      }
      case Op::atan:
        return combine(RETROGRADE_WIDE(atan)(x), {{&a, 1 / (1 + x * x)}}, false);
      case Op::atan2: {
        const Dual b = operand(call.args[1]);
        const Wide square = x * x + b.v * b.v;
        return combine(RETROGRADE_WIDE(atan2)(x, b.v), {{&a, b.v / square}, {&b, -x / square}},
                       false);
      }
      case Op::hypot: {
        const Dual b = operand(call.args[1]);
        const Wide v = RETROGRADE_WIDE(hypot)(x, b.v);
        return combine(v, {{&a, x / v}, {&b, b.v / v}}, false);
      }
      case Op::pow: {  // the exponent is a constant
        const Wide p = operand(call.args[1]).v, v = RETROGRADE_WIDE(pow)(x, p);
        return combine(v, {{&a, p * RETROGRADE_WIDE(pow)(x, p - 1)}}, false);
      }
      default:
        internal_error("the oracle of forms does not know this operator");
    }
  }

  const std::vector<Expr>& order_;
  const Place& at_;
  double epsilon_;
  std::mt19937_64 random_;
  const Evaluation* exact_ = nullptr;
  const Spread* spread_ = nullptr;
  std::unordered_map<const ir::ExprNode*, Dual> values_;
};

}  // namespace

TrueGradient true_gradient(const Expr& any, const Place& at, uint64_t seed) {
  const Expr e = autodiff::with_equal_nodes_shared({any}).front();
  const std::vector<Expr> order = autodiff::post_order({e});
  TrueGradient result;
  Evaluation exact(order, at, 0, seed);
  if (!exact.run()) return result;
  const double epsilon = (e.type().bits() == 64 ? 0x1p-53 : 0x1p-24) * units;
  Spread spread;
  for (int t = 1; t <= trials; ++t) {
    Evaluation moved(order, at, epsilon, seed + static_cast<uint64_t>(t));
    if (!moved.run()) return result;
    moved.widen(spread, exact);
  }
  for (size_t k = 0; k < leaf_count; ++k) result.slope[k] = static_cast<double>(exact.of(e).d[k]);
  for (int t = 1; t <= trials; ++t) {
    Evaluation moved(exact, spread, epsilon, seed + static_cast<uint64_t>(t + trials));
    if (!moved.run()) return result;
    for (size_t k = 0; k < leaf_count; ++k) {
      const double by = static_cast<double>(size_of(moved.of(e).d[k] - exact.of(e).d[k]));
      result.reach[k] = std::max(result.reach[k], by);
    }
  }
  result.is_usable = true;
  return result;
}

}  // namespace retrograde::gradient
