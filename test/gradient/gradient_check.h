// Checks gradients of small programs against central differences in double, element by element, in the interpreter.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <random>

#include "autodiff/derivative.h"
#include "frontend/language/boundary_conditions.h"
#include "frontend/language/func.h"
#include "frontend/language/inline_reductions.h"
#include "ir/print.h"
#include "support/own_threads.h"
#include "testing/interpreter.h"

namespace retrograde::gradient {

// Random values that are exact in float32: odd multiples of 2^-7 in (low, high), so that none is close to another's
// kink.
inline Buffer<float> random_image(const std::vector<int>& sizes, double low, double high,
                                  unsigned seed) {
  Buffer<float> result(sizes);
  std::mt19937 random(seed);
  int steps = static_cast<int>((high - low) * 64);
  std::uniform_int_distribution<int> pick(0, steps - 1);
  result.get()->for_each_value(
      [&](float& v) { v = static_cast<float>(low + (2 * pick(random) + 1) / 128.0); });
  return result;
}

// A scalar that weighs every element differently, so that misplaced gradients show.
inline Func weighted_sum(const Func& f, const std::vector<int>& sizes) {
  Func loss("loss");
  std::vector<Range> ranges;
  for (int n : sizes) ranges.push_back({0, n});
  RDom r(ranges);
  std::vector<Expr> at;
  Expr weight = 1.0f;
  for (size_t d = 0; d < sizes.size(); ++d) {
    at.push_back(r[static_cast<int>(d)]);
    weight =
        weight + cast<float>(r[static_cast<int>(d)] + 1) * (0.25f + 0.125f * static_cast<float>(d));
  }
  loss() = 0.0f;
  loss() += f(at) * weight + 0.5f * f(at) * f(at);
  return loss;
}

inline oracle::Array evaluate(const Func& f, const oracle::Region& region) {
  oracle::InterpreterOptions options;
  options.widen = true;
  return oracle::Interpreter(options).realize(f.function(), region).front();
}

inline double evaluate_scalar(const Func& f) {
  oracle::Region region;
  region.mins.assign(static_cast<size_t>(f.dimensions()), 0);
  region.extents.assign(static_cast<size_t>(f.dimensions()), 1);
  return evaluate(f, region).values[0].scalar.as_double();
}

// The derivative of loss by one element of `image`. Richardson extrapolation makes the error fourth order in the step.
inline double difference(const Func& loss, Buffer<float>& image, const std::vector<int>& point) {
  float& element = image.get()->operator()(point.data());
  const float center = element;
  auto slope = [&](float h) {
    element = center + h;
    double up = evaluate_scalar(loss);
    element = center - h;
    double down = evaluate_scalar(loss);
    element = center;
    return (up - down) / (2.0 * h);
  };
  double coarse = slope(1.0f / 256), fine = slope(1.0f / 512);
  return (4 * fine - coarse) / 3;
}

inline Buffer<float> run_on_threads(Func& gradient, const oracle::Region& region, int threads,
                                    bool backward) {
  Buffer<float> result(region.extents);
  result.set_min(region.mins);
  OwnThreads context(threads, backward);
  gradient.realize(&context, result);
  return result;
}

// Compares bit by bit; NaNs too.
inline bool same_bits(const Buffer<float>& a, const Buffer<float>& b) {
  return std::memcmp(a.data(), b.data(), a.size_in_bytes()) == 0;
}

// Checks the gradient as machine code, under its default schedule, in float32. Each element must be within the rounding
// that the interpreter allows it, and have the same bits on every number of threads. If a rounding could tip a
// decision, such as an index computed from floats, the element only has to agree to 1e-4 of the largest one.
inline void expect_machine_code_agrees(Func gradient, const oracle::Region& region) {
  const oracle::Array expected = oracle::Interpreter({.rounding = oracle::Rounding::Contraction})
                                     .realize(gradient.function(), region)
                                     .front();
  const Buffer<float> first = run_on_threads(gradient, region, 1, false);
  const auto comparison =
      oracle::compare(expected, *const_cast<Buffer<float>&>(first).raw_buffer(), 4);
  EXPECT_TRUE(comparison.agrees())
      << comparison.mismatches << " elements differ, the first " << comparison.first_mismatch;
  double scale = 1;
  for (const oracle::Value& v : expected.values)
    scale = std::max(scale, std::abs(v.scalar.as_double()));
  region.for_each([&](const std::vector<int>& point) {
    const oracle::Value& v = expected.at(point);
    if (!v.is_stable()) {
      EXPECT_NEAR(first.get()->operator()(point.data()), v.scalar.as_double(), 1e-4 * scale);
    }
  });
  for (int threads : {1, 2, 4, 8}) {
    EXPECT_TRUE(same_bits(first, run_on_threads(gradient, region, threads, threads == 4)))
        << "other bits on " << threads << " threads";
  }
}

// Checks d(image) on all of the image, and that it is 0 in a ring around it.
inline void expect_gradient(const Func& loss, const Derivative& d, Buffer<float>& image,
                            double tolerance = 1e-5) {
  Func gradient = d(image);
  ASSERT_TRUE(gradient.defined()) << d.explain(Detail::All);
  oracle::Region region = oracle::region_of(*image.raw_buffer()), around = region;
  for (size_t k = 0; k < region.mins.size(); ++k) around.mins[k] -= 2, around.extents[k] += 4;
  oracle::Array found;
  ASSERT_NO_THROW(found = evaluate(gradient, region)) << d.explain(Detail::All);
  region.for_each([&](const std::vector<int>& point) {
    double expected = difference(loss, image, point), actual = found.at(point).scalar.as_double();
    std::string where;
    for (int p : point) where += std::to_string(p) + " ";
    EXPECT_NEAR(expected, actual, tolerance * (1 + std::abs(expected))) << "at " << where << "\n"
                                                                        << d.explain(Detail::All);
  });
  if (::testing::Test::HasFailure()) return;
  expect_machine_code_agrees(gradient, region);
  if (::testing::Test::HasFailure()) return;
  oracle::Array outside = evaluate(gradient, around);
  around.for_each([&](const std::vector<int>& point) {
    bool inside = true;
    for (size_t k = 0; k < point.size(); ++k) {
      inside &= point[k] >= region.mins[k] && point[k] < region.mins[k] + region.extents[k];
    }
    if (inside) return;
    EXPECT_EQ(outside.at(point).scalar.as_double(), 0.0) << "outside of the image";
  });
}

inline void expect_gradient(const Func& loss, Buffer<float>& image,
                            const AdjointOptions& options = {}) {
  Derivative d = propagate_adjoints(loss, options);
  expect_gradient(loss, d, image);
}

// Bilinear interpolation of an image at data-dependent indices: image(i, j, c) at the pixel positions flow(x, y, 0..1),
// both of `size` by `size`.
inline Func bilinear_warp(const Buffer<float>& image, const Buffer<float>& flow) {
  const int size = image.dim(0).extent();
  Var x("x"), y("y"), c("c");
  Func u("u"), v("v"), warped("warped");
  u(x, y) = clamp(x + flow(x, y, 0), 0.0f, size - 1.0f);
  v(x, y) = clamp(y + flow(x, y, 1), 0.0f, size - 1.0f);
  const Expr i = min(cast<int>(u(x, y)), size - 2), j = min(cast<int>(v(x, y)), size - 2);
  warped(x, y, c) =
      lerp(lerp(image(i, j, c), image(i + 1, j, c), u(x, y) - i),
           lerp(image(i, j + 1, c), image(i + 1, j + 1, c), u(x, y) - i), v(x, y) - j);
  return warped;
}

}  // namespace retrograde::gradient
