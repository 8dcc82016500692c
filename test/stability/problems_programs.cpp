// Problems of the stability suite: complete formulas as users write them, such as losses, normalisations, colour,
// means.
#include <algorithm>

#include "stability/problems.h"

namespace retrograde::stability {

namespace {

// The sum of c(k) x^k over `terms` powers.
template <class Coefficient>
Real series(Real x, int terms, Coefficient c) {
  Real sum = 0, power = 1;
  for (int k = 0; k < terms; ++k, power *= x) sum += c(k) * power;
  return sum;
}
// The derivative of (exp(x) - 1) / x.
Real growth_slope(Real x) {
  if (std::abs(x) > 0.1L) return (std::exp(x) - std::expm1(x) / x) / x;
  return series(x, 14, [](int k) { return (k + 1) / std::tgamma(k + 3.0L); });
}
Real growth(Real x) { return x == 0 ? 1 : std::expm1(x) / x; }
// The derivative of log(1 + x) / x.
Real logarithm_slope(Real x) {
  if (std::abs(x) > 0.1L) return (1 / (1 + x) - std::log1p(x) / x) / x;
  return series(x, 24, [](int k) { return (k % 2 ? 1 : -1) * (k + 1) / (k + 2.0L); });
}

constexpr float labels[] = {0.75f, 0.125f, 0.125f};
Reals smoothed_cross_entropy_gradient(const Reals& x) {
  const Real top = *std::max_element(x.begin(), x.end());
  Reals result;
  Real sum = 0;
  for (Real v : x) result.push_back(std::exp(v - top)), sum += result.back();
  for (size_t i = 0; i < x.size(); ++i) result[i] = result[i] / sum - labels[i];
  return result;
}

// The gradient of the first of n numbers over their norm: (1 - u_0^2) / r and -u_0 u_i / r.
Reals first_of_unit_gradient(const Reals& x) {
  Real r = 0;
  for (Real v : x) r = std::hypot(r, v);
  Reals result{0};
  for (size_t i = 1; i < x.size(); ++i) {
    const Real u = x[i] / r;
    result[0] += u * u / r;
    result.push_back(-(x[0] / r) * u / r);
  }
  return result;
}

// Eight samples, at x in [0, 1], linearly interpolated.
constexpr float samples[] = {0.5f, 2, -1, 0.25f, 3, 3, -2, 1};
Func table_lookup(const Buffer<float>& in) {
  Buffer<float> table(8);
  for (int i = 0; i < 8; ++i) table(i) = samples[i];
  Var c("c");
  Func f("f");
  Expr at = clamp(in(0, c), 0.0f, 1.0f) * 7.0f;
  Expr cell = clamp(cast<int>(floor(at)), 0, 6);
  Expr weight = at - cast<float>(cell);
  f(c) = table(cell) * (1.0f - weight) + table(cell + 1) * weight;
  return f;
}
Traced table_lookup_of(const std::vector<Traced>& x) {
  const Traced at = clamp(x[0], 0.0f, 1.0f) * 7.0f;
  const int cell = std::clamp(static_cast<int>(std::floor(at.own)), 0, 6);
  const Traced weight = at - static_cast<float>(cell);
  return samples[cell] * (1.0f - weight) + samples[cell + 1] * weight;
}

std::vector<Problem> quotients_that_cancel() {
  return {
      pointwise(
          "(exp(x) - 1) / x", 1, [](const auto& x) { return (exp(x[0]) - 1.0f) / x[0]; },
          [](const Reals& x) { return Reals{growth_slope(x[0])}; }),
      pointwise(
          "(1 - exp(-x)) / x", 1, [](const auto& x) { return (1.0f - exp(-x[0])) / x[0]; },
          [](const Reals& x) { return Reals{-growth_slope(-x[0])}; }),
      pointwise(
          "x / (exp(x) - 1)", 1, [](const auto& x) { return x[0] / (exp(x[0]) - 1.0f); },
          [](const Reals& x) {
            const Real v = growth(x[0]);
            return Reals{-growth_slope(x[0]) / v / v};
          }),
      pointwise(
          "log(1 + x) / x", 1, [](const auto& x) { return log(1.0f + x[0]) / x[0]; },
          [](const Reals& x) { return Reals{logarithm_slope(x[0])}; }),
  };
}

std::vector<Problem> losses() {
  return {
      pointwise(
          "cross entropy of softmax with smoothed labels", 3,
          [](const auto& x) {
            auto a = exp(x[0]), b = exp(x[1]), c = exp(x[2]), sum = a + b + c;
            return -(labels[0] * log(a / sum) + labels[1] * log(b / sum) +
                     labels[2] * log(c / sum));
          },
          smoothed_cross_entropy_gradient),
      pointwise(
          "the same, shifted by the largest", 3,
          [](const auto& x) {
            auto m = max(max(x[0], x[1]), x[2]);
            auto sum = exp(x[0] - m) + exp(x[1] - m) + exp(x[2] - m);
            return log(sum) + m - (labels[0] * x[0] + labels[1] * x[1] + labels[2] * x[2]);
          },
          smoothed_cross_entropy_gradient),
      pointwise("select(x > 0, -x log(x), 0)", 1,
                [](const auto& x) { return select(x[0] > 0.0f, -x[0] * log(x[0]), 0.0f * x[0]); }),
      pointwise("-x log(max(x, 1e-12))", 1,
                [](const auto& x) { return -x[0] * log(max(x[0], 1e-12f)); }),
      pointwise(
          "select(x > 0, x log(x / y), 0)", 2,
          [](const auto& x) { return select(x[0] > 0.0f, x[0] * log(x[0] / x[1]), 0.0f * x[0]); }),
      pointwise("(x - y)² / (2 exp(s)²) + s", 3,
                [](const auto& x) {
                  auto z = (x[0] - x[1]) / exp(x[2]);
                  return 0.5f * z * z + x[2];
                }),
      pointwise("log(1 + x² / 2)", 1, [](const auto& x) { return log(1.0f + x[0] * x[0] / 2.0f); }),
      pointwise("x² / (1 + x²)", 1,
                [](const auto& x) { return x[0] * x[0] / (1.0f + x[0] * x[0]); }),
  };
}

std::vector<Problem> normalisations() {
  auto deviations = [](const auto& x) {
    auto mean = (x[0] + x[1] + x[2]) / 3.0f;
    return std::vector{x[0] - mean, x[1] - mean, x[2] - mean};
  };
  auto variance = [](const auto& d) { return (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]) / 3.0f; };
  return {
      pointwise("(x - mean) / sqrt(variance + 1e-5)", 3,
                [=](const auto& x) {
                  auto d = deviations(x);
                  return d[0] / sqrt(variance(d) + 1e-5f);
                }),
      pointwise("select(variance > 0, (x - mean) / sqrt(variance), 0)", 3,
                [=](const auto& x) {
                  auto d = deviations(x);
                  auto v = variance(d);
                  return select(v > 0.0f, d[0] / sqrt(v), 0.0f * d[0]);
                }),
      pointwise("cosine of (x, y) and (z, w), norms at least 1e-8", 4,
                [](const auto& x) {
                  auto norms = sqrt(x[0] * x[0] + x[1] * x[1]) * sqrt(x[2] * x[2] + x[3] * x[3]);
                  return (x[0] * x[2] + x[1] * x[3]) / max(norms, 1e-8f);
                }),
      pointwise(
          "quaternion over its norm", 4,
          [](const auto& x) {
            return x[0] / sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2] + x[3] * x[3]);
          },
          first_of_unit_gradient),
      pointwise("sqrt(x² + 0)", 1, [](const auto& x) { return sqrt(x[0] * x[0] + 0.0f); }),
      pointwise("cube root of |x|³ + |y|³", 2,
                [](const auto& x) {
                  return pow(pow(abs(x[0]), 3.0f) + pow(abs(x[1]), 3.0f), 1.0f / 3.0f);
                }),
      pointwise("x / |x| max(|x| - 0.5, 0)", 1,
                [](const auto& x) { return x[0] / abs(x[0]) * max(abs(x[0]) - 0.5f, 0.0f); }),
  };
}

std::vector<Problem> means_and_powers() {
  return {
      pointwise("pow(x y z, 1 / 3)", 3,
                [](const auto& x) { return pow(x[0] * x[1] * x[2], 1.0f / 3.0f); }),
      pointwise("2 / (1 / x + 1 / y)", 2,
                [](const auto& x) { return 2.0f / (1.0f / x[0] + 1.0f / x[1]); }),
      pointwise("log(|x w - y z|)", 4,
                [](const auto& x) { return log(abs(x[0] * x[3] - x[1] * x[2])); }),
      pointwise("pow(x, 0)", 1, [](const auto& x) { return pow(x[0], 0.0f); }),
      pointwise("pow(x, 5)", 1, [](const auto& x) { return pow(x[0], 5.0f); }),
      pointwise("pow(x, -2)", 1, [](const auto& x) { return pow(x[0], -2.0f); }),
      pointwise("pow(x / y, 2)", 2, [](const auto& x) { return pow(x[0] / x[1], 2.0f); }),
  };
}

std::vector<Problem> colours() {
  return {
      pointwise("sRGB", 1,
                [](const auto& x) {
                  return select(x[0] < 0.0031308f, 12.92f * x[0],
                                1.055f * pow(x[0], 1.0f / 2.4f) - 0.055f);
                }),
      pointwise("pow(clamp(x, 0, 1), 2.2)", 1,
                [](const auto& x) { return pow(clamp(x[0], 0.0f, 1.0f), 2.2f); }),
      pointwise("x (1 + x / 16) / (1 + x)", 1,
                [](const auto& x) { return x[0] * (1.0f + x[0] / 16.0f) / (1.0f + x[0]); }),
      pointwise("x (2.51 x + 0.03) / (x (2.43 x + 0.59) + 0.14)", 1,
                [](const auto& x) {
                  return x[0] * (2.51f * x[0] + 0.03f) / (x[0] * (2.43f * x[0] + 0.59f) + 0.14f);
                }),
      pointwise("hue of (x, y, z), 0 for grey", 3,
                [](const auto& x) {
                  auto top = max(max(x[0], x[1]), x[2]), d = top - min(min(x[0], x[1]), x[2]);
                  auto second = select(top == x[1], 2.0f + (x[2] - x[0]) / d,  //
                                       4.0f + (x[0] - x[1]) / d);
                  return select(d == 0.0f, 0.0f * d,
                                select(top == x[0], (x[1] - x[2]) / d, second));
                }),
      pointwise("saturation of (x, y, z), 0 for black", 3,
                [](const auto& x) {
                  auto top = max(max(x[0], x[1]), x[2]), low = min(min(x[0], x[1]), x[2]);
                  return select(top > 0.0f, (top - low) / top, 0.0f * top);
                }),
      {"table of eight at clamp(x, 0, 1), linear", 1, table_lookup, table_lookup_of, {}},
  };
}

}  // namespace

Family programs() {
  Family result{"Losses, normalisations, means, colours", {}};
  for (const auto& part :
       {quotients_that_cancel(), losses(), normalisations(), means_and_powers(), colours()})
    result.problems.insert(result.problems.end(), part.begin(), part.end());
  return result;
}

}  // namespace retrograde::stability
