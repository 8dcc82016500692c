// solve.cpp -- see solve.h.
#include "solve.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace fluid {

using retrograde::Buffer;
using retrograde::Expr;
using retrograde::Func;
using retrograde::RDom;
using retrograde::Type;
using retrograde::Var;

namespace {

// A table of any floating-point type, filled from a function in double.
template <typename Value>
Buffer<> make_table(Type scalar, int width, int height, Value&& value) {
  const auto filled = [&](auto table) {
    for (int j = 0; j < height; ++j) {
      for (int i = 0; i < width; ++i) table(i, j) = value(i, j);
    }
    return Buffer<>(table);
  };
  return scalar.bits() == 64 ? filled(Buffer<double>(width, height))
                             : filled(Buffer<float>(width, height));
}

// The orthonormal eigenvectors of an axis' second difference, with its eigenvalues.
class Waves {
 public:
  explicit Waves(const Axis& axis) : axis_(axis) {}

  // Wave `k` at sample n. Between walls of zeros, wave 0 does not exist and is 0.
  double value(int k, int n) const {
    if (axis_.ends == Ends::Zero) {
      return std::sqrt(2.0 / cells()) * std::sin(std::numbers::pi * k * n / cells());
    }
    const double scale = std::sqrt((k == 0 ? 1.0 : 2.0) / cells());
    return scale * std::cos(std::numbers::pi * k * (n + 0.5) / cells());
  }
  // 2 - 2 cos(pi k / cells), in a form that keeps the digits of small values.
  double eigenvalue(int k) const {
    const double s = std::sin(std::numbers::pi * k / (2 * cells()));
    return 4 * s * s;
  }

 private:
  double cells() const { return axis_.ends == Ends::Zero ? axis_.samples - 1 : axis_.samples; }
  Axis axis_;
};

Expr constant(Type scalar, double value) { return retrograde::cast(scalar, Expr(value)); }

// The sum of the four neighbours of f(x, y).
Expr neighbours(const Func& f, const System& s, const Var& x, const Var& y) {
  const Func e =
      retrograde::BoundaryConditions::repeat_edge(f, {{0, s.x.samples}, {0, s.y.samples}});
  return e(x - 1, y) + e(x + 1, y) + e(x, y - 1) + e(x, y + 1);
}

// 0 on walls where the solution is zero, `value` elsewhere.
Expr zero_on_walls(const System& s, const Var& x, const Var& y, const Expr& value) {
  Expr result = value;
  const auto mask = [&](const Var& n, const Axis& axis) {
    if (axis.ends == Ends::Free) return;
    result = retrograde::select(n == 0 || n == axis.samples - 1, constant(s.scalar, 0), result);
  };
  mask(x, s.x);
  mask(y, s.y);
  return result;
}

// The factors of Golub and Varga's three-term recurrence, one per iteration.
std::vector<double> chebyshev_factors(const System& s, int iterations) {
  const double slowest = (1 + std::cos(std::numbers::pi / std::max(s.x.samples, s.y.samples))) / 2;
  // The spectral radius that this many iterations reduce to a twentieth; longer waves are not reduced.
  const double reachable = 1 / std::cosh(std::acosh(20.0) / iterations);
  const double radius = std::min(slowest, reachable);
  std::vector<double> factors{1.0};
  for (int n = 1; n < iterations; ++n) {
    const double share = n == 1 ? 0.5 : factors.back() / 4;
    factors.push_back(1 / (1 - radius * radius * share));
  }
  return factors;
}

}  // namespace

Func solve_directly(const System& s) {
  const Var x("x"), y("y"), i("i"), j("j");
  const int width = s.x.samples, height = s.y.samples;
  const Waves along_x(s.x), along_y(s.y);
  // Each product reads its matrix along rows, so the waves along x are stored in both orders.
  const Buffer<> to_x =
      make_table(s.scalar, width, width, [&](int k, int n) { return along_x.value(k, n); });
  const Buffer<> from_x =
      make_table(s.scalar, width, width, [&](int n, int k) { return along_x.value(k, n); });
  const Buffer<> waves_y =
      make_table(s.scalar, height, height, [&](int k, int n) { return along_y.value(k, n); });
  const Buffer<> square_x =
      make_table(s.scalar, width, 1, [&](int k, int) { return along_x.eigenvalue(k); });
  const Buffer<> square_y =
      make_table(s.scalar, height, 1, [&](int k, int) { return along_y.eigenvalue(k); });

  const RDom n(0, width), m(0, height), k(0, width), l(0, height);
  Func rows(s.name + "_rows"), waves(s.name + "_waves"), solved(s.name + "_solved"),
      back(s.name + "_back"), solution(s.name);
  rows(i, y) = constant(s.scalar, 0);
  rows(i, y) += to_x(i, n) * s.right_side(n, y);
  waves(i, j) = constant(s.scalar, 0);
  waves(i, j) += rows(i, m) * waves_y(j, m);
  const Expr square = s.rate * (square_x(i, 0) + square_y(j, 0));
  solved(i, j) =
      s.shifted ? waves(i, j) / (constant(s.scalar, 1) + square)
                : retrograde::select(i == 0 && j == 0, constant(s.scalar, 0), waves(i, j) / square);
  back(i, y) = constant(s.scalar, 0);
  back(i, y) += solved(i, l) * waves_y(l, y);
  solution(x, y) = constant(s.scalar, 0);
  solution(x, y) += from_x(x, k) * back(k, y);
  return solution;
}

Func solve_by_iterations(const System& s, int iterations) {
  const Var x("x"), y("y");
  const Expr four = constant(s.scalar, 4);
  const Expr diagonal = s.shifted ? constant(s.scalar, 1) + four * s.rate : four * s.rate;
  const std::vector<double> factors =
      s.shifted ? std::vector<double>(iterations, 1.0) : chebyshev_factors(s, iterations);
  Func before, now = s.right_side;
  for (int n = 0; n < iterations; ++n) {
    Func next(s.name + "_" + std::to_string(n));
    // Starts from 0 if the shift is 0, so the neighbours are 0 in the first iteration.
    Expr step = s.right_side(x, y);
    if (s.shifted || n > 0) step += s.rate * neighbours(now, s, x, y);
    step = step / diagonal;
    if (factors[n] != 1) {
      const Expr from = n > 1 ? Expr(before(x, y)) : constant(s.scalar, 0);
      step = from + constant(s.scalar, factors[n]) * (step - from);
    }
    next(x, y) = zero_on_walls(s, x, y, step);
    before = now;
    now = next;
  }
  return now;
}

}  // namespace fluid
