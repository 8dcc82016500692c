// Problems of the stability suite: norms, exponentials and similar functions, whose naive partials overflow, underflow
// or cancel.
#include <algorithm>

#include "stability/problems.h"

namespace retrograde::stability {

namespace {

constexpr float tiny_norm = 1e-12f;

// The softmax weights, without overflow.
Reals softmax(const Reals& x) {
  const Real top = *std::max_element(x.begin(), x.end());
  Reals result;
  Real sum = 0;
  for (Real v : x) result.push_back(std::exp(v - top)), sum += result.back();
  for (Real& v : result) v /= sum;
  return result;
}
// The gradient of the first softmax weight: p0 (1 - p0) and -p0 pi, with 1 - p0 as the sum of the others.
Reals softmax_gradient(const Reals& x) {
  const Reals p = softmax(x);
  Reals result{0};
  for (size_t i = 1; i < p.size(); ++i) {
    result.push_back(-p[0] * p[i]);
    result[0] -= result[i];
  }
  return result;
}
// The gradient of -log of the first weight.
Reals cross_entropy_gradient(const Reals& x) {
  Reals result = softmax(x);
  result[0] = 0;
  for (size_t i = 1; i < result.size(); ++i) result[0] -= result[i];
  return result;
}
// The gradient of x / |(x, y)|: y² / r³ and -x y / r³.
Reals unit_gradient(const Reals& x) {
  const Real r = std::hypot(x[0], x[1]), u = x[0] / r, w = x[1] / r;
  return {w * w / r, -u * w / r};
}
ExactGradient of_one(Real (*derivative)(Real)) {
  return [derivative](const Reals& x) { return Reals{derivative(x[0])}; };
}

}  // namespace

Family norms() {
  auto length = [](const auto& x) { return sqrt(x[0] * x[0] + x[1] * x[1]); };
  return {
      "Norms",
      {
          pointwise("x²", 1, [](const auto& x) { return x[0] * x[0]; }),
          pointwise("sqrt(x² + y²)", 2, length),
          pointwise("sqrt(x² + y² + z²)", 3,
                    [](const auto& x) { return sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]); }),
          pointwise("hypot(x, y)", 2, [](const auto& x) { return hypot(x[0], x[1]); }),
          pointwise("m sqrt((x/m)² + (y/m)²), m = max(|x|, |y|)", 2,
                    [](const auto& x) {
                      auto m = max(abs(x[0]), abs(x[1])), a = x[0] / m, b = x[1] / m;
                      return select(m > 0.0f, m * sqrt(a * a + b * b), 0.0f * m);
                    }),
          pointwise("sqrt(x² + 1e-6)", 1, [](const auto& x) { return sqrt(x[0] * x[0] + 1e-6f); }),
          pointwise("|x| + |y|", 2, [](const auto& x) { return abs(x[0]) + abs(x[1]); }),
          pointwise("max(|x|, |y|)", 2, [](const auto& x) { return max(abs(x[0]), abs(x[1])); }),
          pointwise("|x - y|", 2, [](const auto& x) { return abs(x[0] - x[1]); }),
          pointwise("sqrt((x - y)²)", 2,
                    [](const auto& x) { return sqrt((x[0] - x[1]) * (x[0] - x[1])); }),
          pointwise(
              "x / sqrt(x² + y²)", 2, [length](const auto& x) { return x[0] / length(x); },
              unit_gradient),
          pointwise(
              "x / hypot(x, y)", 2, [](const auto& x) { return x[0] / hypot(x[0], x[1]); },
              unit_gradient),
          pointwise(
              "x / max(sqrt(x² + y²), 1e-12)", 2,
              [length](const auto& x) { return x[0] / max(length(x), tiny_norm); },
              [](const Reals& x) {
                const bool floored = !(std::hypot(x[0], x[1]) > tiny_norm);
                return floored ? Reals{1 / Real(tiny_norm), 0} : unit_gradient(x);
              }),
          pointwise(
              "x (1 / sqrt(x² + y²))", 2,
              [length](const auto& x) { return x[0] * (1.0f / length(x)); }, unit_gradient),
          pointwise(
              "x pow(x² + y², -1/2)", 2,
              [](const auto& x) { return x[0] * pow(x[0] * x[0] + x[1] * x[1], -0.5f); },
              unit_gradient),
          pointwise("1 / sqrt(x² + y²)", 2, [length](const auto& x) { return 1.0f / length(x); }),
          pointwise("Huber(x)", 1,
                    [](const auto& x) {
                      return select(abs(x[0]) < 1.0f, 0.5f * x[0] * x[0], abs(x[0]) - 0.5f);
                    }),
      }};
}

Family exponentials() {
  auto lse = [](const auto& x) { return log(exp(x[0]) + exp(x[1]) + exp(x[2])); };
  auto shifted_lse = [](const auto& x) {
    auto m = max(max(x[0], x[1]), x[2]);
    return m + log(exp(x[0] - m) + exp(x[1] - m) + exp(x[2] - m));
  };
  auto first_weight = [](const auto& x) { return exp(x[0]) / (exp(x[0]) + exp(x[1]) + exp(x[2])); };
  auto shifted_weight = [](const auto& x) {
    auto m = max(max(x[0], x[1]), x[2]);
    return exp(x[0] - m) / (exp(x[0] - m) + exp(x[1] - m) + exp(x[2] - m));
  };
  auto sigma = [](const auto& x) { return 1.0f / (1.0f + exp(-x[0])); };
  auto sigma_slope = of_one([](Real x) { return logistic(x) * logistic(-x); });
  return {
      "Exponentials",
      {
          pointwise("1 / (1 + exp(-x))", 1, sigma, sigma_slope),
          pointwise(
              "exp(x) / (1 + exp(x))", 1,
              [](const auto& x) { return exp(x[0]) / (1.0f + exp(x[0])); }, sigma_slope),
          pointwise("tanh(x)", 1, [](const auto& x) { return tanh(x[0]); }),
          pointwise(
              "log(1 + exp(x))", 1, [](const auto& x) { return log(1.0f + exp(x[0])); },
              of_one(logistic)),
          pointwise(
              "max(x, 0) + log(1 + exp(-|x|))", 1,
              [](const auto& x) { return max(x[0], 0.0f) + log(1.0f + exp(-abs(x[0]))); },
              of_one(logistic)),
          pointwise(
              "-log(1 / (1 + exp(-x)))", 1, [sigma](const auto& x) { return -log(sigma(x)); },
              of_one([](Real x) { return -logistic(-x); })),
          pointwise("log(1 + x)", 1, [](const auto& x) { return log(1.0f + x[0]); }),
          pointwise("exp(x) - 1", 1, [](const auto& x) { return exp(x[0]) - 1.0f; }),
          pointwise("log(exp(x) + exp(y) + exp(z))", 3, lse, softmax),
          pointwise("log-sum-exp of three, shifted by the largest", 3, shifted_lse, softmax),
          pointwise("softmax of three", 3, first_weight, softmax_gradient),
          pointwise("softmax of three, shifted by the largest", 3, shifted_weight,
                    softmax_gradient),
          pointwise(
              "-log(softmax of three)", 3,
              [first_weight](const auto& x) { return -log(first_weight(x)); },
              cross_entropy_gradient),
          pointwise(
              "log-sum-exp - x", 3, [shifted_lse](const auto& x) { return shifted_lse(x) - x[0]; },
              cross_entropy_gradient),
          pointwise(
              "exp(-x²)", 1, [](const auto& x) { return exp(-x[0] * x[0]); }, of_one([](Real x) {
                const Real e = std::exp(-x * x);
                return e == 0 ? 0 : -2 * x * e;
              })),
          pointwise(
              "x / (1 + exp(-x))", 1, [sigma](const auto& x) { return x[0] * sigma(x); },
              of_one([](Real x) {
                const Real rest = logistic(-x);
                return logistic(x) + (rest == 0 || logistic(x) == 0 ? 0 : x * logistic(x) * rest);
              })),
          pointwise(
              "x (1 + erf(x / sqrt(2))) / 2", 1,
              [](const auto& x) { return 0.5f * x[0] * (1.0f + erf(x[0] * 0.70710678f)); },
              of_one([](Real x) {
                const Real root = 0.70710678f, e = std::exp(-x * x * root * root);
                return 0.5L * std::erfc(-x * root) +
                       (e == 0 ? 0 : 0.5L * x * root * 1.12837916709551257L * e);
              })),
          pointwise("select(x > 0, x, exp(x) - 1)", 1,
                    [](const auto& x) { return select(x[0] > 0.0f, x[0], exp(x[0]) - 1.0f); }),
          pointwise("sinh(x)", 1, [](const auto& x) { return sinh(x[0]); }),
          pointwise(
              "log(cosh(x))", 1, [](const auto& x) { return log(cosh(x[0])); },
              of_one([](Real x) { return std::tanh(x); })),
          pointwise("asinh(x)", 1, [](const auto& x) { return asinh(x[0]); }),
          pointwise("acosh(x)", 1, [](const auto& x) { return acosh(x[0]); }),
          pointwise("atanh(x)", 1, [](const auto& x) { return atanh(x[0]); }),
          pointwise("x log(x)", 1, [](const auto& x) { return x[0] * log(x[0]); }),
          pointwise(
              "-x log(x) - (1 - x) log(1 - x)", 1,
              [](const auto& x) { return -x[0] * log(x[0]) - (1.0f - x[0]) * log(1.0f - x[0]); }),
      }};
}

}  // namespace retrograde::stability
