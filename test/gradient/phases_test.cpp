// Tests gradients of strided sums: they are split into phases of the stride, have the right values at all sizes, and no
// vector of their loops divides or takes a remainder.
#include <gtest/gtest.h>

#include <retrograde/retrograde.h>

#include "driver/schedule.h"
#include "graph/graph.h"
#include "ir/build.h"
#include "lower/lower.h"
#include "support/costly_vectors.h"

namespace retrograde {
namespace {

float weight_at(int i) { return static_cast<float>((i * 3 + 1) % 5) - 1.5f; }
float seed_at(int i) { return static_cast<float>(((i + 40) * 5) % 7) - 3.0f; }

// out(x) = sum of image(stride * x + dilation * r + start) * weights(r) for x in [first, first + width).
struct Strided {
  int stride, taps, width, dilation = 1, start = 0, first = 0;

  int image_min() const { return stride * first + start; }
  int image_extent() const {
    return width > 0 ? stride * (width - 1) + dilation * (taps - 1) + 1 : 0;
  }
  std::vector<float> expected() const {
    std::vector<float> result(static_cast<size_t>(image_extent()));
    for (int x = 0; x < width; ++x) {
      for (int r = 0; r < taps; ++r)
        result[static_cast<size_t>(stride * x + dilation * r)] += seed_at(x + first) * weight_at(r);
    }
    return result;
  }
  Buffer<float> seed() const {
    Buffer<float> result(width);
    result.set_min(first);
    for (int x = first; x < first + width; ++x) result(x) = seed_at(x);
    return result;
  }
  Buffer<float> weights() const {
    Buffer<float> result(taps);
    for (int r = 0; r < taps; ++r) result(r) = weight_at(r);
    return result;
  }
  Func convolved(const Func& of, const Buffer<float>& by) const {
    Func out("out");
    RDom r(0, taps, "r");
    out(x) = 0.0f;
    out(x) += of(stride * x + dilation * r + start) * by(r);
    return out;
  }
  void expect_right(Func gradient) const {
    Buffer<float> found(image_extent());
    found.set_min(image_min());
    gradient.realize(found);
    const std::vector<float> wanted = expected();
    for (int i = 0; i < image_extent(); ++i)
      EXPECT_FLOAT_EQ(found(i + image_min()), wanted[static_cast<size_t>(i)])
          << "stride " << stride << ", taps " << taps << ", width " << width << ", dilation "
          << dilation << ", start " << start << ", first " << first << " at " << i;
  }

  Var x{"x"};
};

// The gradient by an image whose size is that of its buffer.
Func gradient_of(const Strided& sum) {
  Buffer<float> image(sum.image_extent());
  image.set_min(sum.image_min());
  image.fill(1.0f);
  const Func out = sum.convolved(Func(image), sum.weights());
  return propagate_adjoints(out, Func(sum.seed()), {{sum.first, sum.width}})(image);
}

bool has_phases(const Func& gradient) {
  const auto order = graph::topological_order({gradient.function()});
  return std::any_of(order.begin(), order.end(), [](const graph::FuncPtr& f) {
    return f->name.find("_phases") != std::string::npos;
  });
}

TEST(Phases, StridedSumsAreRight) {
  for (const int stride : {2, 3, 5}) {
    for (const int taps : {1, 2, 3, 5, 8}) {
      for (const int width : {40, 41, 67}) {
        const Strided sum{stride, taps, width};
        const Func gradient = gradient_of(sum);
        EXPECT_EQ(has_phases(gradient), taps > stride) << stride << ", " << taps;
        sum.expect_right(gradient);
      }
    }
  }
}

TEST(Phases, DilationsAreRight) {
  for (const int dilation : {2, 3, 4}) {
    const Strided sum{2, 5, 50, dilation};
    sum.expect_right(gradient_of(sum));
  }
}

TEST(Phases, OddStartsAndNegativeElementsAreRight) {
  for (const int start : {-7, -2, 1, 3}) {
    for (const int first : {-20, -3, 0, 5}) {
      const Strided sum{3, 7, 45, 1, start, first};
      const Func gradient = gradient_of(sum);
      EXPECT_TRUE(has_phases(gradient));
      sum.expect_right(gradient);
    }
  }
}

TEST(Phases, AreAlongTheLanesIfTheStrideIsLong) {
  for (const int stride : {16, 24, 100}) {
    const Strided sum{stride, 3 * stride + 1, 9};
    const Func gradient = gradient_of(sum);
    EXPECT_TRUE(has_phases(gradient));
    sum.expect_right(gradient);
  }
}

// Sizes that are known at run time only, some smaller than the stride.
TEST(Phases, AllSizesAreRight) {
  for (const int stride : {2, 3}) {
    Param<int> width("width");
    ImageParam image(Float(32), 1, "image"), seed(Float(32), 1, "seed");
    const Func out = Strided{stride, 5, 0}.convolved(Func(image), Strided{stride, 5, 0}.weights());
    Func gradient = propagate_adjoints(out, Func(seed), {{0, width}})(image);
    EXPECT_TRUE(has_phases(gradient));
    for (const int size : {1, 2, 3, 17, 40}) {
      const Strided sum{stride, 5, size};
      width.set(size);
      seed.set(sum.seed());
      Buffer<float> values(sum.image_extent());
      values.fill(1.0f);
      image.set(values);
      sum.expect_right(gradient);
    }
  }
}

TEST(Phases, TwoDimensionsAreRight) {
  const int width = 20, height = 7, channels = 3, filters = 2;
  Buffer<float> image(2 * width + 1, 2 * height + 1, channels), weights(3, 3, channels, filters),
      seed(width, height, filters);
  image.fill(1.0f);
  int i = 0;
  weights.for_each_value([&](float& v) { v = weight_at(i++); });
  seed.for_each_value([&](float& v) { v = seed_at(i++); });
  Var x("x"), y("y"), k("k");
  Func out("out");
  RDom r(0, 3, 0, 3, 0, channels, "r");
  out(x, y, k) = 0.0f;
  out(x, y, k) += image(2 * x + r.x, 2 * y + r.y, r.z) * weights(r.x, r.y, r.z, k);
  Func gradient =
      propagate_adjoints(out, Func(seed), {{0, width}, {0, height}, {0, filters}})(image);
  EXPECT_TRUE(has_phases(gradient));
  const Buffer<float> found = gradient.realize({2 * width + 1, 2 * height + 1, channels});
  Buffer<float> expected(2 * width + 1, 2 * height + 1, channels);
  expected.fill(0.0f);
  for (int f = 0; f < filters; ++f) {
    for (int c = 0; c < channels; ++c) {
      for (int v = 0; v < height; ++v) {
        for (int u = 0; u < width; ++u) {
          for (int a = 0; a < 9; ++a)
            expected(2 * u + a % 3, 2 * v + a / 3, c) +=
                seed(u, v, f) * weights(a % 3, a / 3, c, f);
        }
      }
    }
  }
  for (int c = 0; c < channels; ++c) {
    for (int v = 0; v < 2 * height + 1; ++v) {
      for (int u = 0; u < 2 * width + 1; ++u)
        EXPECT_FLOAT_EQ(found(u, v, c), expected(u, v, c)) << u << ", " << v << ", " << c;
    }
  }
}

// ---- loops ----

// The code of the gradient under the schedule that the compiler chooses.
Stmt lowered(const Func& gradient) {
  const std::vector<graph::FuncPtr> scheduled = driver::schedule_unscheduled({gradient.function()});
  return lower::lower("gradient", scheduled, lower::infer_arguments(scheduled), {}).body;
}

TEST(Phases, VectorsDoNotDivide) {
  for (const int stride : {2, 3, 128}) {
    const Strided sum{stride, 4 * stride + 1, 64};
    const CostlyVectors found = costly_vectors(lowered(gradient_of(sum)), "rho");
    EXPECT_GT(found.loops, 0) << stride;
    EXPECT_EQ(found.operations, 0) << stride;
  }
}

}  // namespace
}  // namespace retrograde
