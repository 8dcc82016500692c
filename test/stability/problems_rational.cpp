// Problems of the stability suite: quotients, powers, angles and ill-conditioned systems, with poles, cancellation and
// overflow of intermediate values.
#include "stability/problems.h"

namespace retrograde::stability {

Family quotients() {
  return {
      "Quotients and powers",
      {
          pointwise("1 / x", 1, [](const auto& x) { return 1.0f / x[0]; }),
          pointwise("x / y", 2, [](const auto& x) { return x[0] / x[1]; }),
          pointwise("x y", 2, [](const auto& x) { return x[0] * x[1]; }),
          pointwise(
              "x / (x + y)", 2, [](const auto& x) { return x[0] / (x[0] + x[1]); },
              [](const Reals& x) {
                const Real s = x[0] + x[1];
                if (std::isinf(x[1])) return Reals{0, 0};
                return Reals{x[1] / s / s, -x[0] / s / s};
              }),
          pointwise(
              "(x - y) / (x + y)", 2, [](const auto& x) { return (x[0] - x[1]) / (x[0] + x[1]); },
              [](const Reals& x) {
                const Real s = x[0] + x[1];
                return Reals{2 * x[1] / s / s, -2 * x[0] / s / s};
              }),
          pointwise(
              "x / (1 + x)", 1, [](const auto& x) { return x[0] / (1.0f + x[0]); },
              [](const Reals& x) { return Reals{1 / (1 + x[0]) / (1 + x[0])}; }),
          pointwise(
              "(1 - x²) / (1 + x²)", 1,
              [](const auto& x) { return (1.0f - x[0] * x[0]) / (1.0f + x[0] * x[0]); },
              [](const Reals& x) {
                const Real s = 1 + x[0] * x[0];
                return Reals{-4 * x[0] / s / s};
              }),
          pointwise("x y / (x + y)", 2, [](const auto& x) { return x[0] * x[1] / (x[0] + x[1]); }),
          pointwise("1 / (1 + x²)", 1, [](const auto& x) { return 1.0f / (1.0f + x[0] * x[0]); }),
          pointwise("sqrt(x)", 1, [](const auto& x) { return sqrt(x[0]); }),
          pointwise("1 / sqrt(x)", 1, [](const auto& x) { return 1.0f / sqrt(x[0]); }),
          pointwise("sqrt(x y)", 2, [](const auto& x) { return sqrt(x[0] * x[1]); }),
          pointwise("sqrt(x² + 1) - 1", 1,
                    [](const auto& x) { return sqrt(x[0] * x[0] + 1.0f) - 1.0f; }),
          pointwise("x³", 1, [](const auto& x) { return pow(x[0], 3.0f); }),
          pointwise("pow(|x|, 0.3)", 1, [](const auto& x) { return pow(abs(x[0]), 0.3f); }),
          pointwise("pow(x, y)", 2, [](const auto& x) { return pow(x[0], x[1]); }),
          pointwise("pow(2, x)", 1, [](const auto& x) { return pow(2.0f, x[0]); }),
          pointwise("log(x / y)", 2, [](const auto& x) { return log(x[0] / x[1]); }),
          pointwise("log(|x|)", 1, [](const auto& x) { return log(abs(x[0])); }),
      }};
}

Family angles() {
  return {"Angles",
          {
              pointwise("atan2(x, y)", 2, [](const auto& x) { return atan2(x[0], x[1]); }),
              pointwise("atan(x / y)", 2, [](const auto& x) { return atan(x[0] / x[1]); }),
              pointwise("atan(x)", 1, [](const auto& x) { return atan(x[0]); }),
              pointwise("asin(clamp(x, -1, 1))", 1,
                        [](const auto& x) { return asin(clamp(x[0], -1.0f, 1.0f)); }),
              pointwise("acos(clamp(x, -0.999, 0.999))", 1,
                        [](const auto& x) { return acos(clamp(x[0], -0.999f, 0.999f)); }),
              pointwise(
                  "sin(x) / x, 1 at 0", 1,
                  [](const auto& x) {
                    return select(abs(x[0]) < 1e4f,
                                  select(x[0] == 0.0f, 1.0f + 0.0f * x[0], sin(x[0]) / x[0]),
                                  0.0f * x[0]);
                  },
                  [](const Reals& x) {
                    const Real v = x[0], square = v * v;
                    if (!(std::abs(v) < 1e4L)) return Reals{0};
                    if (std::abs(v) < 0.01L) return Reals{-v / 3 * (1 - square / 10)};
                    return Reals{(std::cos(v) - std::sin(v) / v) / v};
                  }),
              pointwise("refraction: select(k < 0, 0, e c - sqrt(k)), k = 1 - e² (1 - c²)", 2,
                        [](const auto& x) {
                          auto e = x[0], c = x[1], k = 1.0f - e * e * (1.0f - c * c);
                          return select(k < 0.0f, 0.0f * e, e * c - sqrt(k));
                        }),
              pointwise("refraction: e c - sqrt(max(k, 0))", 2,
                        [](const auto& x) {
                          auto e = x[0], c = x[1], k = 1.0f - e * e * (1.0f - c * c);
                          return e * c - sqrt(max(k, 0.0f));
                        }),
              pointwise("Schlick: r + (1 - r) (1 - c)^5, c clamped", 2,
                        [](const auto& x) {
                          auto q = 1.0f - clamp(x[1], 0.0f, 1.0f);
                          return x[0] + (1.0f - x[0]) * q * q * q * q * q;
                        }),
          }};
}

Family ill_conditioned() {
  return {
      "Ill-conditioned",
      {
          pointwise(
              "2 x 2 system by Cramer: (d - 2 b) / (a d - b c)", 4,
              [](const auto& x) { return (x[3] - 2.0f * x[1]) / (x[0] * x[3] - x[1] * x[2]); }),
          pointwise("2 x 2 system by elimination", 4,
                    [](const auto& x) {
                      auto factor = x[2] / x[0];
                      auto second = (2.0f - factor) / (x[3] - factor * x[1]);
                      return (1.0f - x[1] * second) / x[0];
                    }),
          pointwise("nearly singular: 1 / ((1 + x) (1 + y) - 1)", 2,
                    [](const auto& x) { return 1.0f / ((1.0f + x[0]) * (1.0f + x[1]) - 1.0f); }),
          pointwise("regularised: x / (x² + 1e-8)", 1,
                    [](const auto& x) { return x[0] / (x[0] * x[0] + 1e-8f); }),
          pointwise("root of t² + 2 x t - y: sqrt(x² + y) - x", 2,
                    [](const auto& x) { return sqrt(x[0] * x[0] + x[1]) - x[0]; }),
          pointwise("the same root: y / (sqrt(x² + y) + x)", 2,
                    [](const auto& x) { return x[1] / (sqrt(x[0] * x[0] + x[1]) + x[0]); }),
          pointwise("larger eigenvalue of (x z; z y)", 3,
                    [](const auto& x) {
                      auto h = 0.5f * (x[0] - x[1]);
                      return 0.5f * (x[0] + x[1]) + sqrt(h * h + x[2] * x[2]);
                    }),
          pointwise("area from sides (Heron)", 3,
                    [](const auto& x) {
                      auto s = 0.5f * (x[0] + x[1] + x[2]);
                      return sqrt(max(s * (s - x[0]) * (s - x[1]) * (s - x[2]), 0.0f));
                    }),
          pointwise("x² - y²", 2, [](const auto& x) { return x[0] * x[0] - x[1] * x[1]; }),
      }};
}

}  // namespace retrograde::stability
