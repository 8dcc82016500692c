// Numbers that record their computation: an oracle for gradients of small programs that shares no code with the
// compiler.
//
// A Traced number has two values: `exact`, with 64 bits of precision and exponents up to 4932, and `own`, the value in
// float32, which decides branches. Operations record themselves with their exact partials on the Tape of their inputs;
// Tape::differentiate walks it backwards. An adjoint of exactly 0 stays 0, whatever it is multiplied by.
//
// A number `has_left` float32 if its own value is not finite, or has no digit of the exact one. A gradient has left
// float32 if a number on its path has, or if the exact adjoint of such a number, or a contribution to it, is beyond
// float32's largest number or below its smallest. A float32 program cannot be expected to be right in these cases.
#pragma once

#include <cmath>
#include <limits>
#include <vector>

namespace retrograde::stability {

using Real = long double;
using Reals = std::vector<Real>;

class Tape;

struct Traced {
  Real exact = 0;
  float own = 0;
  bool has_left = false;
  Tape* tape = nullptr;  // none: a constant
  size_t index = 0;
  Traced() = default;
  Traced(float constant) : exact(constant), own(constant) {}
};

class Tape {
 public:
  Traced input(float value) { return put(Traced(value), {}); }
  struct Operand {
    const Traced& of;
    Real partial;
  };
  Traced put(Traced result, std::initializer_list<Operand> operands) {
    result.tape = this;
    result.index = nodes_.size();
    Node node{{}, result.has_left};
    for (const Operand& o : operands) {
      if (o.of.tape) node.operands.push_back({o.of.index, o.partial});
    }
    nodes_.push_back(node);
    return result;
  }

  struct Gradient {
    Reals adjoints;  // the adjoints of the inputs
    bool has_left = false;
  };
  Gradient differentiate(const Traced& output, size_t inputs) const {
    using Limits = std::numeric_limits<float>;
    Gradient result;
    Reals adjoints(nodes_.size(), 0);
    if (output.tape) adjoints[output.index] = 1;
    for (size_t n = nodes_.size(); n-- > 0;) {
      const Real adjoint = adjoints[n], size = std::abs(adjoint);
      if (adjoint == 0) continue;
      const bool is_input = n < inputs;
      if (!is_input &&
          (nodes_[n].has_left || !(size <= Limits::max()) || size < Limits::denorm_min()))
        result.has_left = true;
      for (const auto& [operand, partial] : nodes_[n].operands) {
        const Real contribution = adjoint * partial;
        result.has_left |= !(std::abs(contribution) <= Limits::max());
        adjoints[operand] += contribution;
      }
    }
    result.has_left |= output.has_left;
    result.adjoints.assign(adjoints.begin(), adjoints.begin() + static_cast<long>(inputs));
    return result;
  }

 private:
  struct Edge {
    size_t operand;
    Real partial;
  };
  struct Node {
    std::vector<Edge> operands;
    bool has_left;
  };
  std::vector<Node> nodes_;
};

namespace tracing {

inline Traced result(Real exact, float own) {
  Traced r;
  r.exact = exact;
  r.own = own;
  r.has_left = !std::isfinite(own) || (exact != own && !(std::abs(exact - own) < std::abs(exact)));
  return r;
}
inline Traced unary(const Traced& a, Real exact, float own, Real partial) {
  Traced r = result(exact, own);
  return a.tape ? a.tape->put(r, {{a, partial}}) : r;
}
inline Traced binary(const Traced& a, const Traced& b, Real exact, float own, Real by_a,
                     Real by_b) {
  Traced r = result(exact, own);
  Tape* tape = a.tape ? a.tape : b.tape;
  return tape ? tape->put(r, {{a, by_a}, {b, by_b}}) : r;
}

}  // namespace tracing

inline Traced operator+(const Traced& a, const Traced& b) {
  return tracing::binary(a, b, a.exact + b.exact, a.own + b.own, 1, 1);
}
inline Traced operator-(const Traced& a, const Traced& b) {
  return tracing::binary(a, b, a.exact - b.exact, a.own - b.own, 1, -1);
}
inline Traced operator-(const Traced& a) { return tracing::unary(a, -a.exact, -a.own, -1); }
inline Traced operator*(const Traced& a, const Traced& b) {
  return tracing::binary(a, b, a.exact * b.exact, a.own * b.own, b.exact, a.exact);
}
inline Traced operator/(const Traced& a, const Traced& b) {
  const Real v = a.exact / b.exact;
  return tracing::binary(a, b, v, a.own / b.own, 1 / b.exact, -v / b.exact);
}
inline bool operator<(const Traced& a, const Traced& b) { return a.own < b.own; }
inline bool operator>(const Traced& a, const Traced& b) { return a.own > b.own; }
inline bool operator==(const Traced& a, const Traced& b) { return a.own == b.own; }
inline bool operator!=(const Traced& a, const Traced& b) { return a.own != b.own; }

inline Traced select(bool c, const Traced& a, const Traced& b) { return c ? a : b; }
// As in the language, max returns the second operand at a tie or if one is NaN.
inline Traced max(const Traced& a, const Traced& b) { return a > b ? a : b; }
inline Traced min(const Traced& a, const Traced& b) { return a < b ? a : b; }
inline Traced clamp(const Traced& a, const Traced& low, const Traced& high) {
  return max(min(a, high), low);
}
inline bool is_finite(const Traced& a) { return std::isfinite(a.own); }

// Defines a function of one operand x, with the exact value v.
#define RETROGRADE_TRACED(name, partial)                    \
  inline Traced name(const Traced& a) {                     \
    const Real x = a.exact;                                 \
    [[maybe_unused]] const Real v = std::name(x);           \
    return tracing::unary(a, v, std::name(a.own), partial); \
  }
RETROGRADE_TRACED(abs, x > 0 ? 1 : x < 0 ? -1 : 0)
RETROGRADE_TRACED(sqrt, 1 / (2 * v))
RETROGRADE_TRACED(exp, v)
RETROGRADE_TRACED(log, 1 / x)
RETROGRADE_TRACED(sin, std::cos(x))
RETROGRADE_TRACED(cos, -std::sin(x))
RETROGRADE_TRACED(asin, 1 / std::sqrt((1 - x) * (1 + x)))
RETROGRADE_TRACED(acos, -1 / std::sqrt((1 - x) * (1 + x)))
RETROGRADE_TRACED(atan, 1 / (1 + x * x))
RETROGRADE_TRACED(sinh, std::cosh(x))
RETROGRADE_TRACED(cosh, std::sinh(x))
RETROGRADE_TRACED(tanh, 1 / (std::cosh(x) * std::cosh(x)))
RETROGRADE_TRACED(asinh, 1 / std::sqrt(1 + x * x))
RETROGRADE_TRACED(acosh, 1 / std::sqrt((x - 1) * (x + 1)))
RETROGRADE_TRACED(atanh, 1 / ((1 - x) * (1 + x)))
RETROGRADE_TRACED(erf, 1.1283791670955125738961589L * std::exp(-x * x))
#undef RETROGRADE_TRACED

inline Traced hypot(const Traced& a, const Traced& b) {
  const Real v = std::hypot(a.exact, b.exact);
  return tracing::binary(a, b, v, std::hypot(a.own, b.own), v == 0 ? 0 : a.exact / v,
                         v == 0 ? 0 : b.exact / v);
}
inline Traced atan2(const Traced& y, const Traced& x) {
  const Real r = y.exact * y.exact + x.exact * x.exact;
  return tracing::binary(y, x, std::atan2(y.exact, x.exact), std::atan2(y.own, x.own),
                         r == 0 ? 0 : x.exact / r, r == 0 ? 0 : -y.exact / r);
}
// The partial by the exponent is 0 at a base of 0, because the value stays 0 nearby.
inline Traced pow(const Traced& a, const Traced& p) {
  const Real v = std::pow(a.exact, p.exact);
  return tracing::binary(a, p, v, std::pow(a.own, p.own),
                         p.exact == 0 ? 0 : p.exact * std::pow(a.exact, p.exact - 1),
                         a.exact == 0 ? 0 : v * std::log(a.exact));
}

}  // namespace retrograde::stability
