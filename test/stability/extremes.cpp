#include "stability/extremes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

namespace retrograde::stability {

namespace {

using Limits = std::numeric_limits<float>;

Extreme extreme_of(float v) {
  const float m = std::abs(v);
  if (std::isnan(v)) return Extreme::NaNs;
  if (std::isinf(v)) return Extreme::Infinities;
  if (m > 1e18f) return Extreme::Huge;  // the square overflows
  if (m == 0) return Extreme::Zeros;
  if (m < Limits::min()) return Extreme::Denormals;
  if (m < 1e-18f) return Extreme::Tiny;  // the square underflows
  return m > 50 ? Extreme::Large : Extreme::Ordinary;
}

const std::vector<float> ordinary = {-3.25f, -1.5f, -0.625f, 0.375f, 0.5f, 0.75f, 1.25f, 2.5f, 20};

std::vector<float> numbers() {
  std::vector<float> result = ordinary;
  for (float m : {0.0f,
                  Limits::denorm_min(),
                  1e-40f,
                  Limits::min(),
                  1e-30f,
                  1e-20f,
                  1e-10f,
                  1e-5f,
                  0.001f,
                  1.0f,
                  88.5f,
                  104.0f,
                  1e4f,
                  1e8f,
                  1e15f,
                  1e19f,
                  2e20f,
                  1e30f,
                  Limits::max() / 2,
                  Limits::max(),
                  Limits::infinity()}) {
    result.push_back(m);
    result.push_back(-m);
  }
  result.push_back(Limits::quiet_NaN());
  return result;
}

}  // namespace

const char* to_string(Extreme extreme) {
  constexpr std::array<const char*, extreme_count> names = {"ordinary", "large", "zeros",    "tiny",
                                                            "denormal", "huge",  "infinite", "NaN"};
  return names[static_cast<size_t>(extreme)];
}

Extreme extreme_of(const std::vector<float>& numbers) {
  Extreme result = Extreme::Ordinary;
  for (float v : numbers) result = std::max(result, extreme_of(v));
  return result;
}

std::vector<std::vector<float>> cases(int n) {
  const std::vector<float> all = numbers();
  std::vector<std::vector<float>> result;
  if (n == 1) {
    for (float v : all) result.push_back({v});
    return result;
  }
  if (n == 2) {
    for (float v : all) {
      for (float w : all) result.push_back({v, w});
    }
    return result;
  }
  std::mt19937 random(7);
  auto pick = [&](const std::vector<float>& from) { return from[random() % from.size()]; };
  // Three kinds of cases: all numbers extreme; one extreme and the others ordinary; all numbers equal.
  for (int c = 0; c < 1500; ++c) {
    std::vector<float> x;
    const float same = pick(all);
    for (int i = 0; i < n; ++i)
      x.push_back(c % 3 == 0 ? pick(all) : c % 3 == 1 ? pick(ordinary) : same);
    if (c % 3 == 1) x[random() % x.size()] = same;
    result.push_back(x);
  }
  return result;
}

}  // namespace retrograde::stability
