// Gradients by the weights of strided layers, as the autoscheduler runs them: right, with the same bits for each decision
// that is left out and each number of threads.
#include <gtest/gtest.h>

#include <retrograde/retrograde.h>

#include <cmath>
#include <limits>
#include <set>

#include "gradient/gradient_check.h"

namespace retrograde {
namespace {

const Var x("x"), y("y"), c("c");

// out(x, y, c) = sum of in(stride * x + r.x, stride * y + r.y, r.z) * weights(r.x, r.y, r.z, c), or its transpose: the
// output has zeros between the elements of the input.
struct StridedLayer {
  StridedLayer(int stride, int channels, int filters, bool is_transposed, int taps = 3,
               int rows = 3, int terms_of_row = 70)
      : stride(stride), is_transposed(is_transposed) {
    const int size = is_transposed ? terms_of_row : terms_of_row * stride;
    in = gradient::random_image({size, size, channels}, -1, 1, 7);
    weights = gradient::random_image({taps, rows, channels, filters}, -1, 1, 8);
    out_size = is_transposed ? terms_of_row * stride : terms_of_row;
    seed = gradient::random_image({out_size, out_size, filters}, -1, 1, 9);
  }

  Pipeline gradient() const {
    const Func padded =
        BoundaryConditions::constant_exterior(in, 0.0f, {{0, in.width()}, {0, in.height()}});
    Func out("out"), spread("spread");
    const RDom r(0, weights.width(), 0, weights.height(), 0, in.channels(), "r");
    const Expr x0 = is_transposed ? x + 1 - r.x : stride * x + r.x - 1,
               y0 = is_transposed ? y + 1 - r.y : stride * y + r.y - 1;
    spread(x, y, c) =
        select(x % stride == 0 && y % stride == 0, padded(x / stride, y / stride, c), 0.0f);
    out(x, y, c) = 0.0f;
    out(x, y, c) += (is_transposed ? spread : padded)(x0, y0, r.z) * weights(r.x, r.y, r.z, c);
    return Pipeline(propagate_adjoints(out, seed)(weights));
  }
  // `without`: decisions that the schedule lacks.
  Buffer<float> result(const std::set<Decision>& without = {}, int threads = 2) const {
    Pipeline pipeline = gradient();
    pipeline.set_autoschedule({.without = without});
    pipeline.jit_handlers().thread_limit = threads;
    return pipeline.realize(
        {weights.width(), weights.height(), weights.dim(2).extent(), weights.dim(3).extent()});
  }
  // The largest error of the gradient of a layer that is not transposed, at some of its elements.
  double error_of(const Buffer<float>& found) const {
    const auto padded = [&](int i, int j, int k) {
      const bool is_inside = i >= 0 && i < in.width() && j >= 0 && j < in.height();
      return is_inside ? double{in(i, j, k)} : 0.0;
    };
    double error = 0;
    for (int f = 0; f < weights.dim(3).extent(); f += 5) {
      const int k = f % in.channels();
      for (int j = 0; j < weights.height(); ++j) {
        for (int i = 0; i < weights.width(); ++i) {
          double expected = 0;
          for (int b = 0; b < out_size; ++b) {
            for (int a = 0; a < out_size; ++a)
              expected += double{seed(a, b, f)} * padded(stride * a + i - 1, stride * b + j - 1, k);
          }
          error = std::max(error, std::abs(found(i, j, k, f) - expected));
        }
      }
    }
    return error;
  }

  int stride = 1, out_size = 0;
  bool is_transposed = false;
  Buffer<float> in, weights, seed;
};

TEST(TurnedSums, KeepEveryBit) {
  for (const StridedLayer& layer : {StridedLayer(2, 64, 8, true), StridedLayer(3, 48, 8, true),
                                    StridedLayer(2, 8, 48, false)}) {
    const Buffer<float> expected = layer.result({Decision::LayoutStaging});
    for (const int threads : {1, 2, 5})
      EXPECT_TRUE(gradient::same_bits(layer.result({}, threads), expected)) << threads;
  }
}

TEST(TurnedSums, AreThoseOfTheDefinition) {
  const StridedLayer layer(2, 16, 48, false);
  const Buffer<float> found = layer.result();
  const auto padded = [&](int i, int j, int k) {
    const bool is_inside = i >= 0 && i < layer.in.width() && j >= 0 && j < layer.in.height();
    return is_inside ? double{layer.in(i, j, k)} : 0.0;
  };
  for (const int k : {0, 7, 15}) {
    for (int i = 0; i < 3; ++i) {
      double expected = 0;
      for (int b = 0; b < layer.out_size; ++b) {
        for (int a = 0; a < layer.out_size; ++a)
          expected += double{layer.seed(a, b, 15 - k)} * padded(2 * a + i - 1, 2 * b + 1, k);
      }
      EXPECT_NEAR(found(i, 2, k, 15 - k), expected, 1e-4) << i << ", " << k;
    }
  }
}

TEST(TurnedSums, AreThoseOfTheDefinitionWithoutLanes) {
  for (const StridedLayer& layer :
       {StridedLayer(2, 40, 48, false, 3, 3, 20), StridedLayer(1, 96, 72, false, 3, 1, 31),
        StridedLayer(2, 44, 72, false, 1, 1, 70)}) {
    const Buffer<float> found = layer.result({}, 5);
    EXPECT_LT(layer.error_of(found), 2e-4);
    EXPECT_TRUE(gradient::same_bits(layer.result({}, 1), found));
  }
}

// The output of a transposed layer ends where taps begin: conditions on terms and taps stay outside of tiles.
TEST(TurnedSums, OfTransposedLayersWithoutLanes) {
  for (const StridedLayer& layer :
       {StridedLayer(2, 64, 32, true, 4, 4, 20), StridedLayer(3, 32, 24, true, 5, 5, 12)}) {
    const Buffer<float> found = layer.result(), expected = layer.result({Decision::RegisterTiles});
    double error = 0;
    found.for_each_element([&](const int* at) {
      error = std::max(error, std::abs(double{found(at)} - double{expected(at)}));
    });
    EXPECT_LT(error, 1e-4);
  }
}

// One row of taps has a fixed place in the sums.
TEST(TurnedSums, MayHaveOneRowOfTaps) {
  for (const bool is_transposed : {false, true}) {
    const StridedLayer layer(2, 48, 48, is_transposed, 3, 1);
    EXPECT_TRUE(gradient::same_bits(layer.result(), layer.result({Decision::LayoutStaging})));
  }
}

// An adjoint of 0 gives 0 whatever it is multiplied with; NaN goes where it is read.
TEST(TurnedSums, KeepStrongZeros) {
  for (const bool has_lanes : {true, false}) {
    StridedLayer layer(2, has_lanes ? 16 : 48, 48, false, 3, 3, has_lanes ? 70 : 20);
    layer.in(5, 9, 3) = std::numeric_limits<float>::infinity();
    layer.in(8, 9, 4) = std::nanf("");
    for (int a = 0; a < layer.out_size; ++a) layer.seed(a, 4, 2) = 0.0f;
    const Buffer<float> found = layer.result(), expected = layer.result({Decision::LayoutStaging});
    int finite = 0, alike = 0, all = 0;
    found.for_each_element([&](const int* at) {
      ++all;
      finite += std::isfinite(found(at));
      alike += std::isfinite(found(at)) ? std::abs(found(at) - expected(at)) < 1e-4
                                        : std::isnan(found(at)) == std::isnan(expected(at));
    });
    EXPECT_EQ(alike, all);
    EXPECT_LT(finite, all);
    EXPECT_GT(finite, all / 2);
  }
}

}  // namespace
}  // namespace retrograde
