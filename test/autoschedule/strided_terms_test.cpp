// Sums over elements with zeros in between: the zeros are left out, each result keeps its bits, and tiles of the sums
// have vectors of one phase of the stride.
#include <gtest/gtest.h>

#include <retrograde/retrograde.h>

#include <bit>
#include <cmath>
#include <functional>
#include <limits>
#include <vector>

#include "graph/copy_graph.h"
#include "graph/graph.h"
#include "lower/lower.h"
#include "simplify/simplify.h"
#include "transform/strided_terms.h"

namespace retrograde {
namespace {

using graph::FuncPtr;

constexpr float infinite = std::numeric_limits<float>::infinity();

// Samples have 12 bits: products are exact, as code may contract them with sums or not; sums are rounded.
float sample(int i) {
  const int bits = (i * 1237 + 911) % 4093 - 2000;
  return static_cast<float>(bits == 0 ? 1 : bits) * (i % 3 == 0 ? 0x1p-9f : 0x1p-6f);
}

Buffer<float> samples(const std::vector<int>& sizes) {
  Buffer<float> result(sizes);
  int i = 0;
  result.for_each_value([&](float& v) { v = sample(i++); });
  return result;
}

// A copy of the program whose zeros are left out.
Func without_zeros(const Func& out) {
  const std::vector<FuncPtr> copy = graph::copy_graph({out.function()}).outputs;
  EXPECT_TRUE(transform::has_strided_terms(copy));
  transform::leave_out_zero_terms(copy);
  EXPECT_FALSE(transform::has_strided_terms(copy));
  return Func(copy[0]);
}

bool is_changed(const Func& out) {
  const std::vector<FuncPtr> copy = graph::copy_graph({out.function()}).outputs;
  const auto extents = [](const FuncPtr& f) {
    int64_t result = 1;
    for (const auto& r : f->updates[0].rvars)
      result *= *ir::as_const_int(simplification::simplify(r.extent));
    return result;
  };
  const int64_t before = extents(copy[0]);
  transform::leave_out_zero_terms(copy);
  return extents(copy[0]) < before;
}

// The same bits; all NaNs are alike.
int differences(const Buffer<float>& a, const Buffer<float>& b) {
  int count = 0;
  a.for_each_element([&](const int* at) {
    const bool are_nan = std::isnan(a(at)) && std::isnan(b(at));
    count += !are_nan && std::bit_cast<uint32_t>(a(at)) != std::bit_cast<uint32_t>(b(at));
  });
  return count;
}

// out(x) = start + sum of spread(direction * x + shift - direction * r) * taps(r), where spread has zeros between the
// elements of a signal.
struct Upsampled {
  int stride, count, direction = 1, shift = 1, width = 70;

  Func program(const Buffer<float>& signal, const Buffer<float>& taps, const Expr& start) const {
    Func padded = BoundaryConditions::constant_exterior(signal, 0.0f), spread("spread"), out("out");
    RDom r(0, count, "r");
    spread(x) = select(x % stride == 0, padded(x / stride), 0.0f);
    out(x) = start;
    out(x) += spread(shift + direction * x - r) * taps(r);
    return out;
  }
  void expect_same(const Buffer<float>& signal, const Buffer<float>& taps,
                   const Expr& start = Expr(0.25f)) const {
    Func out = program(signal, taps, start), fast = without_zeros(out);
    EXPECT_EQ(differences(out.realize({width}), fast.realize({width})), 0)
        << "stride " << stride << ", taps " << count << ", direction " << direction << ", shift "
        << shift;
  }

  Var x{"x"};
};

TEST(StridedTerms, KeepEveryBit) {
  for (const int stride : {2, 3, 5}) {
    for (const int count : {2, 3, 4, 6, 7}) {
      for (const int shift : {-3, 0, 1, 4})
        Upsampled{stride, count, 1, shift}.expect_same(samples({40}), samples({count}));
    }
  }
}

TEST(StridedTerms, MayRunBackward) {
  for (const int count : {2, 4, 6})
    Upsampled{2, count, -1, 69}.expect_same(samples({40}), samples({count}));
}

// A term that is left out is 0 times a tap.
TEST(StridedTerms, KeepNaNs) {
  for (const float value : {infinite, -infinite, std::nanf("")}) {
    for (int at = 0; at < 4; ++at) {
      Buffer<float> taps = samples({4});
      taps(at) = value;
      const Upsampled sum{2, 4};
      sum.expect_same(samples({40}), taps);
      Func fast = without_zeros(sum.program(samples({40}), taps, 0.25f));
      const Buffer<float> found = fast.realize({12});
      for (int x = 3; x < 12; ++x)  // before, taps meet the zeros of the border
        EXPECT_EQ(std::isnan(found(x)), std::isnan(value) || (x + 1 - at) % 2 != 0) << x;
    }
  }
}

TEST(StridedTerms, KeepSignsOfZeros) {
  Buffer<float> zeros(40), negative(4), positive(4), mixed(4);
  zeros.fill(-0.0f);
  negative.fill(-1.0f);
  positive.fill(1.0f);
  for (int i = 0; i < 4; ++i) mixed(i) = i == 1 ? 1.0f : -1.0f;
  for (const float start : {0.0f, -0.0f}) {
    for (const Buffer<float>& taps : {negative, positive, mixed}) {
      for (const float value : {0.0f, -0.0f}) {
        zeros.fill(value);
        Upsampled{2, 4}.expect_same(zeros, taps, start);
      }
    }
  }
}

// The zero is the whole term; the condition is the opposite one.
TEST(StridedTerms, MayBeChosenInTheSum) {
  Var x("x");
  const Buffer<float> signal = samples({60}), taps = samples({6});
  for (const bool is_opposite : {false, true}) {
    Func padded = BoundaryConditions::constant_exterior(signal, 0.0f), out("out");
    RDom r(0, 6, "r");
    const Expr place = x - r, term = padded(place / 3) * taps(r);
    out(x) = -0.0f;
    out(x) += is_opposite ? select(place % 3 != 1, 0.0f, term) : select(place % 3 == 1, term, 0.0f);
    EXPECT_EQ(differences(out.realize({100}), without_zeros(out).realize({100})), 0);
  }
}

TEST(StridedTerms, OfIntegersAreLeftOut) {
  Var x("x");
  Buffer<int> signal(40), taps(4);
  for (int i = 0; i < 40; ++i) signal(i) = i * i % 17 - 5;
  for (int i = 0; i < 4; ++i) taps(i) = i + 1;
  Func padded = BoundaryConditions::constant_exterior(signal, 0), out("out");
  RDom r(0, 4, "r");
  out(x) = 0;
  out(x) += select((x - r) % 2 == 0, padded((x - r) / 2), 0) * taps(r);
  const Buffer<int> expected = out.realize({70}), found = without_zeros(out).realize({70});
  for (int i = 0; i < 70; ++i) EXPECT_EQ(found(i), expected(i)) << i;
}

// Reads stay inside of what the program reads, whose ends are those of the signal.
TEST(StridedTerms, ReadNoMoreThanBefore) {
  Var x("x");
  for (const int count : {4, 5}) {
    const Buffer<float> signal = samples({33}), taps = samples({count});
    Func out("out");
    RDom r(0, count, "r");
    out(x) = 0.0f;
    out(x) += select((x + count - 1 - r) % 2 == 0, signal((x + count - 1 - r) / 2), 0.0f) * taps(r);
    const int width = 65 - count + 1;
    EXPECT_EQ(differences(out.realize({width}), without_zeros(out).realize({width})), 0) << count;
  }
}

// A factor that differs from element to element would need as many zeros.
TEST(StridedTerms, StayIfZerosAreMany) {
  Var x("x");
  const Buffer<float> signal = samples({40}), taps = samples({80, 4});
  Func padded = BoundaryConditions::constant_exterior(signal, 0.0f), out("out");
  RDom r(0, 4, "r");
  out(x) = 0.0f;
  out(x) += select((x - r) % 2 == 0, padded((x - r) / 2), 0.0f) * taps(x, r);
  EXPECT_FALSE(is_changed(out));
  EXPECT_TRUE(is_changed(Upsampled{2, 4}.program(signal, samples({4}), 0.0f)));
}

TEST(StridedTerms, StayIfTheFuncIsScheduled) {
  Func out = Upsampled{2, 4}.program(samples({40}), samples({4}), 0.0f);
  out.compute_root().update().vectorize(Var("x"), 8);
  EXPECT_FALSE(is_changed(out));
}

// ---- loops ----

// Transposed convolution with several channels.
struct Doubled {
  explicit Doubled(int taps = 4) : weights(samples({taps, taps, filters, channels})) {
    Func padded = BoundaryConditions::constant_exterior(features, 0.0f,
                                                        {{0, width}, {0, width}, {Expr(), Expr()}});
    Func spread("spread");
    RDom r(0, taps, 0, taps, 0, channels, "r");
    spread(x, y, c) = select(x % 2 == 0 && y % 2 == 0, padded(x / 2, y / 2, c), 0.0f);
    out(x, y, c) = bias(c);
    out(x, y, c) += spread(x + 1 - r.x, y + 1 - r.y, r.z) * weights(r.x, r.y, c, r.z);
    out.set_estimates({{0, 2 * width}, {0, 2 * width}, {0, filters}});
  }
  static constexpr int width = 24, channels = 16, filters = 8;
  Var x{"x"}, y{"y"}, c{"c"};
  Buffer<float> features = samples({width, width, channels}), weights, bias = samples({filters});
  Func out{"out"};
};

TEST(StridedTerms, HaveTilesOfPhases) {
  for (const int taps : {3, 4}) {
    const Doubled plain(taps);
    Func out = without_zeros(plain.out);
    Pipeline(out).auto_schedule(get_host_target());
    for (const int size : {2 * Doubled::width, 37}) {
      Func slow = plain.out;
      const std::vector<int> sizes{size, size, Doubled::filters};
      const Buffer<float> expected = slow.realize(sizes), found = out.realize(sizes);
      expected.for_each_element([&](const int* at) {
        EXPECT_NEAR(found(at), expected(at), 1e-3f * (1 + std::abs(expected(at))));
      });
    }
  }
}

// Vectors of one of three phases, which 16 lanes are no multiple of: several filters share what they read.
TEST(StridedTerms, HaveTilesOfThreePhases) {
  constexpr int channels = 16, filters = 8, width = 40, taps = 6;
  const Buffer<float> sound = samples({width, channels}),
                      weights = samples({taps, filters, channels});
  Var t("t"), c("c");
  const auto program = [&] {
    const Func padded =
        BoundaryConditions::constant_exterior(sound, 0.0f, {{0, width}, {Expr(), Expr()}});
    Func spread("spread"), out("out");
    const RDom r(0, taps, 0, channels, "r");
    spread(t, c) = select(t % 3 == 0, padded(t / 3, c), 0.0f);
    out(t, c) = 0.0f;
    out(t, c) += spread(t + 1 - r.x, r.y) * weights(r.x, c, r.y);
    return out.bound(t, 0, 3 * width + 1).bound(c, 0, filters);
  };
  Func out = without_zeros(program());
  Pipeline(out).auto_schedule(get_host_target());
  const Buffer<float> expected = program().realize({3 * width + 1, filters});
  const Buffer<float> found = out.realize({3 * width + 1, filters});
  expected.for_each_element([&](const int* at) {
    EXPECT_NEAR(found(at), expected(at), 1e-3f * (1 + std::abs(expected(at))));
  });
}

// The gradient of a function of the sums computes them again.
TEST(StridedTerms, AreLeftOutInGradients) {
  const Buffer<float> signal = samples({40}), seed = samples({70});
  Buffer<float> taps = samples({4});
  Var x("x");
  Func sum = Upsampled{2, 4}.program(signal, taps, 0.0f), out("out");
  out(x) = sin(sum(x));
  Func gradient = propagate_adjoints(out, Func(seed), {{0, 70}})(taps);
  const Buffer<float> found = gradient.realize({4});
  for (int r = 0; r < 4; ++r) {
    double expected = 0;
    for (int i = 0; i < 70; ++i) {
      const auto spread = [&](int at) {
        return at % 2 == 0 && at >= 0 && at < 80 ? double{signal(at / 2)} : 0.0;
      };
      double value = 0;
      for (int k = 0; k < 4; ++k) value += spread(i + 1 - k) * double{taps(k)};
      expected += double{seed(i)} * std::cos(value) * spread(i + 1 - r);
    }
    EXPECT_NEAR(found(r), expected, 2e-3 * (1 + std::abs(expected))) << r;
  }
}

}  // namespace
}  // namespace retrograde
