// Problems of the stability suite: activations and losses as users write them, with exponentials and roots. The true
// derivative is finite nearly everywhere.
#include "stability/problems.h"

namespace retrograde::stability {

namespace {

ExactGradient of_one(Real (*derivative)(Real)) {
  return [derivative](const Reals& x) { return Reals{derivative(x[0])}; };
}

// 1 - tanh(x)^2.
Real tanh_slope(Real x) {
  const Real e = std::exp(-2 * std::abs(x));
  return 4 * e / ((1 + e) * (1 + e));
}
Real mish_slope(Real x) {
  const Real softplus = std::max<Real>(x, 0) + std::log1p(std::exp(-std::abs(x)));
  const Real decay = tanh_slope(softplus) * logistic(x);
  return std::tanh(softplus) + (decay == 0 ? 0 : x * decay);
}
constexpr float gelu_scale = 0.7978846f, gelu_cubic = 0.044715f;
Real gelu_slope(Real x) {
  const Real u = gelu_scale * (x + gelu_cubic * x * x * x), slope = tanh_slope(u);
  const Real du = gelu_scale * (1 + 3 * gelu_cubic * x * x);
  return logistic(2 * u) + (slope == 0 ? 0 : 0.5L * x * slope * du);
}

}  // namespace

Family activations() {
  return {
      "Activations and losses",
      {
          pointwise(
              "(exp(x) - exp(-x)) / (exp(x) + exp(-x))", 1,
              [](const auto& x) { return (exp(x[0]) - exp(-x[0])) / (exp(x[0]) + exp(-x[0])); },
              of_one(tanh_slope)),
          pointwise(
              "(1 - exp(-2 x)) / (1 + exp(-2 x))", 1,
              [](const auto& x) { return (1.0f - exp(-2.0f * x[0])) / (1.0f + exp(-2.0f * x[0])); },
              of_one(tanh_slope)),
          pointwise(
              "(exp(x) - 1) / (exp(x) + 1)", 1,
              [](const auto& x) { return (exp(x[0]) - 1.0f) / (exp(x[0]) + 1.0f); },
              of_one([](Real x) { return tanh_slope(x / 2) / 2; })),
          pointwise(
              "2 / (1 + exp(-2 x)) - 1", 1,
              [](const auto& x) { return 2.0f / (1.0f + exp(-2.0f * x[0])) - 1.0f; },
              of_one(tanh_slope)),
          pointwise(
              "max(x, y) + log(1 + exp(-|x - y|))", 2,
              [](const auto& x) { return max(x[0], x[1]) + log(1.0f + exp(-abs(x[0] - x[1]))); },
              [](const Reals& x) {
                return Reals{logistic(x[0] - x[1]), logistic(x[1] - x[0])};
              }),
          pointwise(
              "max(x, 0) - x y + log(1 + exp(-|x|))", 2,
              [](const auto& x) {
                return max(x[0], 0.0f) - x[0] * x[1] + log(1.0f + exp(-abs(x[0])));
              },
              [](const Reals& x) {
                return Reals{logistic(x[0]) - x[1], -x[0]};
              }),
          pointwise(
              "x (1 + tanh(0.8 (x + 0.04 x³))) / 2", 1,
              [](const auto& x) {
                auto cube = x[0] * x[0] * x[0];
                return 0.5f * x[0] * (1.0f + tanh(gelu_scale * (x[0] + gelu_cubic * cube)));
              },
              of_one(gelu_slope)),
          pointwise(
              "x tanh(log(1 + exp(x)))", 1,
              [](const auto& x) { return x[0] * tanh(log(1.0f + exp(x[0]))); }, of_one(mish_slope)),
          pointwise(
              "x / sqrt(1 + x²)", 1, [](const auto& x) { return x[0] / sqrt(1.0f + x[0] * x[0]); },
              of_one([](Real x) {
                const Real r = std::hypot(1.0L, x);
                return 1 / r / r / r;
              })),
          pointwise(
              "x / (1 + |x|)", 1, [](const auto& x) { return x[0] / (1.0f + abs(x[0])); },
              of_one([](Real x) {
                const Real s = 1 + std::abs(x);
                return 1 / s / s;
              })),
          pointwise("log((1 + x) / (1 - x)) / 2", 1,
                    [](const auto& x) { return 0.5f * log((1.0f + x[0]) / (1.0f - x[0])); }),
          pointwise("1 - cos(x)", 1, [](const auto& x) { return 1.0f - cos(x[0]); }),
      }};
}

}  // namespace retrograde::stability
