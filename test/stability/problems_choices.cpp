// Problems of the stability suite: selections whose other branch is NaN or infinite, saturated clamps, interpolation.
#include "stability/problems.h"

namespace retrograde::stability {

Family selections() {
  return {
      "Selections, clamps, interpolation",
      {
          pointwise(
              "select(x > 0, log(x), 0)", 1,
              [](const auto& x) { return select(x[0] > 0.0f, log(x[0]), 0.0f * x[0]); },
              [](const Reals& x) { return Reals{x[0] > 0 ? 1 / x[0] : 0}; }),
          pointwise("select(x > 0, sqrt(x), x)", 1,
                    [](const auto& x) { return select(x[0] > 0.0f, sqrt(x[0]), x[0]); }),
          pointwise("select(y != 0, x / y, x)", 2,
                    [](const auto& x) { return select(x[1] != 0.0f, x[0] / x[1], x[0]); }),
          pointwise("select(|x| < 1, acos(x), x)", 1,
                    [](const auto& x) { return select(abs(x[0]) < 1.0f, acos(x[0]), x[0]); }),
          pointwise("select(x < 80, exp(x), x)", 1,
                    [](const auto& x) { return select(x[0] < 80.0f, exp(x[0]), x[0]); }),
          pointwise(
              "select(x finite, x², 1)", 1,
              [](const auto& x) {
                return select(is_finite(x[0]), x[0] * x[0], 1.0f + 0.0f * x[0]);
              },
              [](const Reals& x) { return Reals{std::isfinite(x[0]) ? 2 * x[0] : 0}; }),
          pointwise("select(x > y, x / (x - y), x)", 2,
                    [](const auto& x) { return select(x[0] > x[1], x[0] / (x[0] - x[1]), x[0]); }),
          pointwise("clamp(x, 0, 1)", 1, [](const auto& x) { return clamp(x[0], 0.0f, 1.0f); }),
          pointwise("clamp(exp(x), 0, 1)", 1,
                    [](const auto& x) { return clamp(exp(x[0]), 0.0f, 1.0f); }),
          pointwise("clamp(1e30 x², 0, 1)", 1,
                    [](const auto& x) { return clamp(1e30f * x[0] * x[0], 0.0f, 1.0f); }),
          pointwise("clamp(x / y, 0, 1)", 2,
                    [](const auto& x) { return clamp(x[0] / x[1], 0.0f, 1.0f); }),
          pointwise("clamp(1 / x, -10, 10)", 1,
                    [](const auto& x) { return clamp(1.0f / x[0], -10.0f, 10.0f); }),
          pointwise("sqrt(clamp(x, 0.001, 1))", 1,
                    [](const auto& x) { return sqrt(clamp(x[0], 0.001f, 1.0f)); }),
          pointwise("log(max(x, 1e-6))", 1, [](const auto& x) { return log(max(x[0], 1e-6f)); }),
          pointwise("smoothstep of (x - y) / 1e-3", 2,
                    [](const auto& x) {
                      auto t = clamp((x[0] - x[1]) / 1e-3f, 0.0f, 1.0f);
                      return t * t * (3.0f - 2.0f * t);
                    }),
          pointwise("x (1 - t) + y t", 3,
                    [](const auto& x) { return x[0] * (1.0f - x[2]) + x[1] * x[2]; }),
          pointwise("x + t (y - x), t clamped", 3,
                    [](const auto& x) { return x[0] + clamp(x[2], 0.0f, 1.0f) * (x[1] - x[0]); }),
          pointwise("min(x, 1 / x)", 1, [](const auto& x) { return min(x[0], 1.0f / x[0]); }),
      }};
}

}  // namespace retrograde::stability
