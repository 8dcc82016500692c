// Programs in the style of Halide's users, with Halide.h and namespace Halide: each compiles, runs,
// and is compared with plain C++.
#include "Halide.h"
#include "support/errors.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <iostream>

using namespace Halide;
using retrograde::expect_error;
using retrograde::Unsupported;

namespace {

// All names are qualified, and Funcs and Vars have no names.
TEST(HalideCompat, BoardOfSquares) {
  Halide::Func board;
  Halide::Var column, rank;
  Halide::Expr is_dark = (column / 5 + rank / 3) % 2 == 1;
  board(column, rank) = Halide::select(is_dark, -column, 100 * rank);
  Halide::Buffer<int32_t> squares = board.realize({37, 22});
  ASSERT_EQ(squares.width(), 37);
  ASSERT_EQ(squares.height(), 22);
  for (int rank_at = 0; rank_at < squares.height(); rank_at++) {
    for (int at = 0; at < squares.width(); at++) {
      const bool dark = (at / 5 + rank_at / 3) % 2 == 1;
      ASSERT_EQ(squares(at, rank_at), dark ? -at : 100 * rank_at);
    }
  }
}

TEST(HalideCompat, WhiteBalanceWithParams) {
  ImageParam photo(UInt(8), 3, "photo");
  Param<float> warmth("warmth", 1.25f), light("light");
  Func balanced("balanced");
  Var x("x"), y("y"), channel("channel");
  Expr of_channel = select(channel == 0, warmth, channel == 2, 1.0f / warmth, 1.0f);
  Expr lit = Halide::cast<float>(photo(x, y, channel)) * of_channel;
  lit = lit + light;
  balanced(x, y, channel) = cast<uint8_t>(clamp(lit, 0.0f, 255.0f));
  balanced.bound(channel, 0, 3).reorder(channel, x, y).unroll(channel);

  Buffer<uint8_t> shot(23, 9, 3);
  shot.for_each_element(
      [&](int i, int j, int k) { shot(i, j, k) = static_cast<uint8_t>(7 * i + 29 * j + 80 * k); });
  photo.set(shot);
  light.set(-12.5f);
  Buffer<uint8_t> out = balanced.realize({shot.width(), shot.height(), shot.channels()});
  const float gains[] = {1.25f, 1.0f, 1.0f / 1.25f};
  out.for_each_element([&](int i, int j, int k) {
    const float expected = std::clamp(shot(i, j, k) * gains[k] - 12.5f, 0.0f, 255.0f);
    ASSERT_EQ(out(i, j, k), static_cast<uint8_t>(expected)) << i << " " << j << " " << k;
  });
}

// A morphological closing: the minimum of the maxima in a neighbourhood. Both windows are clipped
// at the picture's edge.
TEST(HalideCompat, ClosingInFusedTiles) {
  const int width = 53, height = 38;
  Buffer<uint16_t> heights(width, height);
  heights.for_each_element([&](int i, int j) {
    heights(i, j) = static_cast<uint16_t>((i * 7919 + j * j * 104729) % 5003);
  });
  Func edge = BoundaryConditions::repeat_edge(heights), dilated("dilated"), closed("closed");
  Var x("x"), y("y"), across("across"), down("down"), tx("tx"), ty("ty"), tile("tile");
  dilated(x, y) = max(edge(x, y), edge(x + 1, y), edge(x, y + 1), edge(x + 1, y + 1));
  closed(x, y) = min(dilated(x, y), dilated(x - 1, y), dilated(x, y - 1), dilated(x - 1, y - 1));
  closed.tile(x, y, across, down, tx, ty, 16, 4).vectorize(tx, 8);
  closed.fuse(across, down, tile).parallel(tile);
  dilated.compute_at(closed, tile).vectorize(x, 8);
  Buffer<uint16_t> out(width, height);
  closed.realize(out);

  auto at = [&](int i, int j) {
    return heights(std::clamp(i, 0, width - 1), std::clamp(j, 0, height - 1));
  };
  auto largest = [&](int i, int j) {
    return std::max({at(i, j), at(i + 1, j), at(i, j + 1), at(i + 1, j + 1)});
  };
  out.for_each_element([&](int i, int j) {
    const uint16_t expected =
        std::min({largest(i, j), largest(i - 1, j), largest(i, j - 1), largest(i - 1, j - 1)});
    ASSERT_EQ(out(i, j), expected) << i << " " << j;
  });
}

// A picture of labels: the number of pixels of each label, their mean column, and the offset of
// each label in a list sorted by label.
TEST(HalideCompat, AreasAndOffsetsOfLabels) {
  const int labels = 19;
  Buffer<uint8_t> picture(31, 26);
  picture.for_each_element([&](int i, int j) {
    picture(i, j) = static_cast<uint8_t>((i / 4 * 5 + j / 7 * 3) % labels);
  });
  Var label("label");
  RDom pixel(picture), later(1, labels - 1);
  Func area("area"), columns("columns"), begins("begins"), middle("middle");
  area(label) = 0;
  area(picture(pixel.x, pixel.y)) += 1;
  columns(label) = 0;
  columns(picture(pixel.x, pixel.y)) += pixel.x;
  begins(label) = 0;
  begins(later) = begins(later - 1) + area(later - 1);
  middle(label) = Tuple(columns(label) / max(area(label), 1), begins(label));
  area.compute_root();
  columns.compute_root();
  begins.compute_root();
  Realization found = middle.realize({labels});
  Buffer<int> centre = found[0], begin = found[1];

  int count[labels] = {}, sum[labels] = {}, before = 0, pixels = 0;
  picture.for_each_value([&](uint8_t v) { count[v]++; });
  picture.for_each_element([&](int i, int j) { sum[picture(i, j)] += i; });
  for (int k = 0; k < labels; k++) {
    ASSERT_EQ(centre(k), sum[k] / std::max(count[k], 1)) << k;
    ASSERT_EQ(begin(k), before) << k;
    before += count[k];
    pixels += count[k];
  }
  EXPECT_EQ(pixels, picture.width() * picture.height());
}

// Squared distances between all points of two clouds.
TEST(HalideCompat, DistancesBetweenPoints) {
  const int points = 24, dimensions = 10;
  ImageParam here(type_of<float>(), 2, "here"), there(type_of<float>(), 2, "there");
  Var i, j, block_i, block_j, pi, pj;
  RDom axis(0, dimensions);
  Func sum("sum"), squared("squared");
  Expr step = here(i, axis) - there(axis, j);
  sum(i, j) = 0.0f;
  sum(i, j) += step * step;
  squared(i, j) = sum(i, j);
  squared.bound(i, 0, points).bound(j, 0, points);
  squared.tile(i, j, block_i, block_j, pi, pj, 8, 6).vectorize(pi).unroll(pj);
  sum.compute_at(squared, block_i).vectorize(i);
  sum.update().reorder(i, j, axis).unroll(j).vectorize(i);
  Buffer<float> first(points, dimensions), second(dimensions, points);
  first.for_each_element([&](int p, int d) { first(p, d) = static_cast<float>((p * 5 + d) % 13); });
  second.for_each_element(
      [&](int d, int p) { second(d, p) = static_cast<float>((p + d * d) % 9); });
  here.set(first);
  there.set(second);
  Buffer<float> result = squared.realize({points, points});
  result.for_each_element([&](int p, int q) {
    float expected = 0;
    for (int d = 0; d < dimensions; d++) {
      expected += (first(p, d) - second(d, q)) * (first(p, d) - second(d, q));
    }
    ASSERT_EQ(result(p, q), expected) << p << " " << q;
  });
}

// Count, mean and sum of squared deviations in one pass (Welford 1962).
TEST(HalideCompat, MomentsInOnePassByATuple) {
  Func signal, moments;
  Var at;
  signal(at) = cos(cast<float>(at) * 0.5f) * 3.0f;
  RDom sample(0, 80);
  moments() = {0, 0.0f, 0.0f};
  Expr count = moments()[0] + 1;
  Expr from_old = signal(sample) - moments()[1];
  Expr mean = moments()[1] + from_old / count;
  moments() = {count, mean, moments()[2] + from_old * (signal(sample) - mean)};
  Realization result = moments.realize();
  Buffer<int> samples = result[0];
  Buffer<float> average = result[1], deviations = result[2];
  double sum = 0, squares = 0;
  for (int i = 0; i < 80; i++) sum += 3 * std::cos(0.5 * i);
  for (int i = 0; i < 80; i++) squares += std::pow(3 * std::cos(0.5 * i) - sum / 80, 2);
  EXPECT_EQ(samples(), 80);
  EXPECT_NEAR(average(), sum / 80, 1e-5);
  EXPECT_NEAR(deviations(), squares, 1e-3);
}

// Dual numbers as a user-defined type: Newton's method for cube roots, with its steps as a
// dimension of the Func.
TEST(HalideCompat, UserTypesThatActLikeTuples) {
  struct Dual {
    Expr value, slope;
    Dual(Expr v, Expr s) : value(std::move(v)), slope(std::move(s)) {}
    Dual(const Tuple& t) : value(t[0]), slope(t[1]) {}
    Dual(const FuncRef& f) : Dual(Tuple(f)) {}
    operator Tuple() const { return {value, slope}; }
    Dual operator-(Expr constant) const { return {value - constant, slope}; }
    Dual operator*(const Dual& d) const {
      return {value * d.value, slope * d.value + value * d.slope};
    }
    Expr where_tangent_is_zero(const Expr& x) const { return x - value / slope; }
  };
  const int steps = 15;
  Func root, needed;
  Var x, y, step;
  Expr cube = cast<float>(x * x + 3 * y + 2);
  root(x, y, step) = Dual(cube, 1.0f);
  RDom n(1, steps - 1);
  const Dual guess = root(x, y, n - 1);
  root(x, y, n) = Dual((guess * guess * guess - cube).where_tangent_is_zero(guess.value), 1.0f);
  RDom tried(0, steps);
  const Expr cubed = pow(Dual(root(x, y, tried)).value, 3);
  needed(x, y) = argmin(abs(cubed - cube) > cube * 1e-3f)[0];
  root.compute_root();
  Buffer<int> result = needed.realize({11, 8});
  result.for_each_element([&](int i, int j) {
    const float c = static_cast<float>(i * i + 3 * j + 2);
    float r = c;
    int expected = 0;
    for (; std::abs(r * r * r - c) > c * 1e-3f; expected++) r -= (r * r * r - c) / (3 * r * r);
    ASSERT_EQ(result(i, j), expected) << i << " " << j;
  });
}

TEST(HalideCompat, RuntimeBuffersGoInAndOut) {
  Halide::Runtime::Buffer<float, 2> legs(12, 5), hypotenuses(12, 5);
  legs.for_each_element([&](int i, int j) { legs(i, j) = static_cast<float>(3 * j - i); });
  ImageParam leg(Float(32), 2);
  Var x, y;
  Func hypotenuse;
  hypotenuse(x, y) = sqrt(leg(x, y) * leg(x, y) + cast<float>(y * y));
  hypotenuse.vectorize(x, 4);
  leg.set(Buffer<float>(legs));
  hypotenuse.realize(hypotenuses);
  EXPECT_FLOAT_EQ(hypotenuses(0, 4), std::hypot(12.0f, 4.0f));
  EXPECT_FLOAT_EQ(hypotenuses(11, 1), std::hypot(8.0f, 1.0f));
}

TEST(HalideCompat, BoundsOfInputsAreInferred) {
  ImageParam rows(UInt(8), 2, "rows");
  Var x, y;
  Func sheared;
  sheared(x, y) = max(rows(x + y, 2 - y), rows(3 * x + 4, y));
  sheared.infer_input_bounds({7, 6});
  Buffer<uint8_t> needed = rows.get();
  EXPECT_EQ(needed.dim(0).min(), 0);
  EXPECT_EQ(needed.dim(0).max(), 3 * 6 + 4);
  EXPECT_EQ(needed.dim(1).min(), -3);
  EXPECT_EQ(needed.dim(1).extent(), 9);
}

TEST(HalideCompat, EvaluateAndLambda) {
  RDom factor(1, 6);
  EXPECT_EQ(evaluate<int>(product(factor)), 720);
  EXPECT_FLOAT_EQ(evaluate<float>(exp(Expr(-0.75f))), std::exp(-0.75f));
  Var i, j;
  Buffer<int> triangle = lambda(i, j, select(j <= i, i - j, -1)).realize({6, 6});
  EXPECT_EQ(triangle(5, 2), 3);
  EXPECT_EQ(triangle(2, 5), -1);
  uint8_t wrapped = 0;
  double third = 0;
  evaluate(Tuple(cast<uint8_t>(Expr(513)), Expr(1.0) / 3), &wrapped, &third);
  EXPECT_EQ(wrapped, 1);
  EXPECT_EQ(third, 1.0 / 3);
}

TEST(HalideCompat, TargetsTypesAndErrors) {
  const Target here = get_jit_target_from_environment();
  EXPECT_TRUE(here.arch == Target::X86 || here.arch == Target::ARM);
  EXPECT_GE(here.natural_vector_size<uint8_t>(), 16);
  const Type lanes = Int(16).with_lanes(4);
  EXPECT_TRUE(lanes.is_vector() && lanes.is_int() && lanes.bits() == 16);
  EXPECT_EQ(Float(64).bytes(), 8);
  Var u("u"), unused("unused");
  Func wrong("wrong");
  wrong(u) = u % 7;
  EXPECT_THROW(wrong.parallel(unused), CompileError);
  EXPECT_THROW(wrong.realize({4, 4}), RuntimeError);
  EXPECT_THROW(wrong.realize({4, 4, 4}), Halide::Error);
  EXPECT_TRUE(Halide::exceptions_enabled());
  Runtime::Buffer<int16_t> both_namespaces_name_it(2, 6);
  EXPECT_EQ(both_namespaces_name_it.height(), 6);
}

TEST(HalideCompat, ConciseCastsAndBits) {
  using namespace Halide::ConciseCasts;
  Var i;
  Func mixed;
  mixed(i) = Tuple(i8_sat(i32(i) * i * 9 - 140), u16(i << 3) | u16(i & 5), f32(i) / 4 + f32(0.5));
  Realization r = mixed.realize({9});
  Buffer<int8_t> saturated = r[0];
  Buffer<uint16_t> bits = r[1];
  Buffer<float> halves = r[2];
  for (int k = 0; k < 9; k++) {
    EXPECT_EQ(saturated(k), std::clamp(k * k * 9 - 140, -128, 127));
    EXPECT_EQ(bits(k), (k << 3) | (k & 5));
    EXPECT_EQ(halves(k), k / 4.0f + 0.5f);
  }
}

TEST(HalideCompat, PipelinesWithSeveralOutputs) {
  Var x("x"), y("y");
  Func slope("slope"), steep("steep"), ground("ground");
  ground(x, y) = cast<float>((x * x + y) % 11);
  slope(x, y) = ground(x + 1, y) - ground(x, y);
  steep(x, y) = cast<uint8_t>(abs(slope(x, y)) > 4.0f);
  ground.compute_root();
  Pipeline both({steep, slope});
  both.compile_jit();
  Buffer<uint8_t> flags(9, 5);
  Buffer<float> slopes(9, 5);
  both.realize({flags, slopes});
  Realization again = both.realize({9, 5});
  Buffer<float> slopes_again = again[1];
  slopes.for_each_element([&](int i, int j) {
    const int expected = ((i + 1) * (i + 1) + j) % 11 - (i * i + j) % 11;
    EXPECT_EQ(slopes(i, j), expected);
    EXPECT_EQ(slopes_again(i, j), expected);
    EXPECT_EQ(flags(i, j), std::abs(expected) > 4);
  });
}

TEST(HalideCompat, ImplicitVariables) {
  Var x, y, c;
  Func f, g, h;
  f(x, y, c) = x + 10 * y + 100 * c;
  g(_) = f(_) + 1;
  h(x, _) = g(_, x);
  Buffer<int> result = h.realize({2, 3, 4});
  EXPECT_EQ(result(1, 2, 3), 2 + 30 + 100 + 1);
}

TEST(HalideCompat, IntegerArithmeticWithItsWidthSaid) {
  Var x("x");
  Func f("f");
  const Expr divisor = cast<uint8_t>(x % 5 + 1);
  f(x) = Tuple(fast_integer_divide(x - 7, divisor), fast_integer_modulo(x - 7, divisor),
               widening_mul(cast<uint8_t>(x + 250), cast<uint8_t>(200)));
  Realization r = f.realize({12});
  Buffer<int> quotient = r[0], remainder = r[1];
  Buffer<uint16_t> product = r[2];
  for (int i = 0; i < 12; i++) {
    const int d = i % 5 + 1, n = i - 7, floor = n >= 0 ? n / d : -((-n + d - 1) / d);
    EXPECT_EQ(quotient(i), floor);
    EXPECT_EQ(remainder(i), n - floor * d);
    EXPECT_EQ(product(i), ((i + 250) & 255) * 200);
  }
}

// Targets without code generation can be named, and give an error when they are used.
TEST(HalideCompat, WhatIsNotGeneratedSaysSo) {
  Var x("x"), y("y");
  Func f("f");
  f(x, y) = x + y;
  const Target target = get_host_target().with_feature(Target::OpenCL);
  if (target.has_gpu_feature()) {
    EXPECT_THROW(
        Func(f).gpu_tile(x, y, Var("bx"), Var("by"), 8, 8, TailStrategy::Auto, DeviceAPI::OpenCL),
        Unsupported);
  }
  expect_error<Unsupported>(
      {"\"opencl\""}, [&] { Module(f.compile_to_module({}, "f", target)).compile_to_buffer(); });
  EXPECT_EQ(HALIDE_VERSION_MAJOR, 21);
}

}  // namespace
