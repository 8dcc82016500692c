// Programs in the manner of Halide's users, with Halide.h and namespace Halide: each compiles,
// runs, and is compared with plain C++.
#include "Halide.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <iostream>

using namespace Halide;

namespace {

TEST(HalideCompat, GradientImage) {
  Halide::Func gradient;
  Halide::Var x, y;
  Halide::Expr e = x + y;
  gradient(x, y) = e;
  Halide::Buffer<int32_t> output = gradient.realize({80, 60});
  for (int j = 0; j < output.height(); j++) {
    for (int i = 0; i < output.width(); i++) ASSERT_EQ(output(i, j), i + j);
  }
}

TEST(HalideCompat, BrightenAnImageWithAParam) {
  ImageParam input(UInt(8), 3, "input");
  Param<float> gain("gain", 1.5f);
  Func brighter("brighter");
  Var x("x"), y("y"), c("c");
  Expr value = input(x, y, c);
  value = Halide::cast<float>(value);
  value = value * gain;
  value = min(value, 255.0f);
  brighter(x, y, c) = cast<uint8_t>(value);
  brighter.reorder(c, x, y).bound(c, 0, 3).unroll(c);

  Buffer<uint8_t> image(20, 10, 3);
  image.for_each_element(
      [&](int i, int j, int k) { image(i, j, k) = static_cast<uint8_t>(11 * i + 3 * j + k); });
  input.set(image);
  Buffer<uint8_t> output = brighter.realize({image.width(), image.height(), image.channels()});
  output.for_each_element([&](int i, int j, int k) {
    ASSERT_EQ(output(i, j, k), static_cast<uint8_t>(std::min(image(i, j, k) * 1.5f, 255.0f)));
  });
}

TEST(HalideCompat, SeparableBlurTiled) {
  Buffer<uint16_t> input(62, 45);
  input.for_each_element(
      [&](int i, int j) { input(i, j) = static_cast<uint16_t>(i * 31 + j * 17); });
  Func blur_x("blur_x"), blur_y("blur_y");
  Var x("x"), y("y"), xi("xi"), yi("yi"), xo("xo"), yo("yo"), tile_index("tile_index");
  Func clamped = BoundaryConditions::repeat_edge(input);
  blur_x(x, y) = (clamped(x, y) + clamped(x + 1, y) + clamped(x + 2, y)) / 3;
  blur_y(x, y) = (blur_x(x, y) + blur_x(x, y + 1) + blur_x(x, y + 2)) / 3;
  blur_y.tile(x, y, xo, yo, xi, yi, 16, 8)
      .fuse(xo, yo, tile_index)
      .parallel(tile_index)
      .vectorize(xi, 8);
  blur_x.compute_at(blur_y, tile_index).vectorize(x, 8);
  Buffer<uint16_t> output(62, 45);
  blur_y.realize(output);

  auto at = [&](int i, int j) { return input(std::min(i, 61), std::min(j, 44)); };
  auto row = [&](int i, int j) -> uint16_t {
    return static_cast<uint16_t>(at(i, j) + at(i + 1, j) + at(i + 2, j)) / 3;
  };
  for (int j = 0; j < 45; j++) {
    for (int i = 0; i < 62; i++) {
      ASSERT_EQ(output(i, j), static_cast<uint16_t>(row(i, j) + row(i, j + 1) + row(i, j + 2)) / 3)
          << i << " " << j;
    }
  }
}

TEST(HalideCompat, HistogramAndCumulativeSum) {
  Buffer<uint8_t> in(40, 30);
  in.for_each_element([&](int i, int j) { in(i, j) = static_cast<uint8_t>((i * i + j) % 200); });
  Var i("i");
  RDom r(in), b(1, 255);
  Func histogram("histogram"), cdf("cdf");
  histogram(i) = 0;
  histogram(in(r.x, r.y)) += 1;
  cdf(i) = histogram(i);
  cdf(b) = cdf(b - 1) + histogram(b);
  histogram.compute_root();
  Buffer<int> result = cdf.realize({256});
  int expected[256] = {};
  in.for_each_value([&](uint8_t v) { expected[v]++; });
  for (int k = 1; k < 256; k++) expected[k] += expected[k - 1];
  for (int k = 0; k < 256; k++) ASSERT_EQ(result(k), expected[k]) << k;
}

TEST(HalideCompat, MatrixMultiply) {
  const int n = 24;
  ImageParam a(type_of<float>(), 2), b(type_of<float>(), 2);
  Var x, y, xi, yi, xo, yo;
  RDom k(0, n);
  Func product("product"), out("out");
  product(x, y) = 0.0f;
  product(x, y) += a(k, y) * b(x, k);
  out(x, y) = product(x, y);
  out.tile(x, y, xo, yo, xi, yi, 8, 4).vectorize(xi).unroll(yi);
  product.compute_at(out, xo).vectorize(x).update().reorder(x, y, k).vectorize(x).unroll(y);
  Buffer<float> ma(n, n), mb(n, n);
  ma.for_each_element([&](int i, int j) { ma(i, j) = static_cast<float>((i * 3 + j) % 7); });
  mb.for_each_element([&](int i, int j) { mb(i, j) = static_cast<float>((i + j * 5) % 11); });
  a.set(ma);
  b.set(mb);
  out.bound(x, 0, n).bound(y, 0, n);
  Buffer<float> result = out.realize({n, n});
  for (int j = 0; j < n; j++) {
    for (int i = 0; i < n; i++) {
      float expected = 0;
      for (int q = 0; q < n; q++) expected += ma(q, j) * mb(i, q);
      ASSERT_EQ(result(i, j), expected);
    }
  }
}

TEST(HalideCompat, TupleArgmaxByHand) {
  Func source, arg_max;
  Var x;
  source(x) = sin(cast<float>(x));
  RDom r(1, 99);
  arg_max() = {0, source(0)};
  Expr old_index = arg_max()[0], old_max = arg_max()[1];
  Expr new_index = select(old_max < source(r), r, old_index);
  Expr new_max = max(source(r), old_max);
  arg_max() = {new_index, new_max};
  Realization result = arg_max.realize();
  Buffer<int> index = result[0];
  Buffer<float> value = result[1];
  int best = 0;
  for (int i = 1; i < 100; i++) {
    if (std::sin(static_cast<float>(i)) > std::sin(static_cast<float>(best))) best = i;
  }
  EXPECT_EQ(index(0), best);
  EXPECT_NEAR(value(0), std::sin(static_cast<float>(best)), 1e-6);
}

TEST(HalideCompat, UserTypesThatActLikeTuples) {
  struct Complex {
    Expr real, imag;
    Complex(Tuple t) : real(t[0]), imag(t[1]) {}
    Complex(Expr r, Expr i) : real(std::move(r)), imag(std::move(i)) {}
    Complex(FuncRef t) : Complex(Tuple(t)) {}
    operator Tuple() const { return {real, imag}; }
    Complex operator+(const Complex& o) const { return {real + o.real, imag + o.imag}; }
    Complex operator*(const Complex& o) const {
      return {real * o.real - imag * o.imag, real * o.imag + imag * o.real};
    }
    Expr magnitude_squared() const { return real * real + imag * imag; }
  };
  Func mandelbrot;
  Var x, y, t;
  Complex initial(x / 15.0f - 2.5f, y / 6.0f - 2.0f);
  mandelbrot(x, y, t) = Complex(0.0f, 0.0f);
  RDom r(1, 12);
  Complex current = mandelbrot(x, y, r - 1);
  mandelbrot(x, y, r) = current * current + initial;
  Expr escape = Complex(mandelbrot(x, y, r)).magnitude_squared() < 16.0f;
  Tuple first = argmin(escape);
  Func escapes;
  escapes(x, y) = first[0];
  Buffer<int> result = escapes.realize({61, 25});
  for (int j = 0; j < 25; j++) {
    for (int i = 0; i < 61; i++) {
      const float cr = i / 15.0f - 2.5f, ci = j / 6.0f - 2.0f;
      float re = 0, im = 0;
      int escaped = 0;  // stays 0 when no iteration does
      for (int n = 1; n <= 12 && !escaped; n++) {
        const float next = re * re - im * im + cr;
        im = 2 * re * im + ci;
        re = next;
        if (re * re + im * im >= 16.0f) escaped = n;
      }
      ASSERT_EQ(result(i, j), escaped) << i << " " << j;
    }
  }
}

TEST(HalideCompat, RuntimeBuffersGoInAndOut) {
  Halide::Runtime::Buffer<float, 2> in(16, 4), out(16, 4);
  in.for_each_element([&](int i, int j) { in(i, j) = static_cast<float>(i - j); });
  Var x, y;
  ImageParam p(Float(32), 2);
  Func f;
  f(x, y) = abs(p(x, y)) + sqrt(cast<float>(x));
  p.set(Buffer<float>(in));
  f.vectorize(x, 4);
  f.realize(out);
  EXPECT_FLOAT_EQ(out(9, 3), 6.0f + 3.0f);
}

TEST(HalideCompat, BoundsOfInputsAreInferred) {
  ImageParam in(Int(32), 2, "in_bounds");
  Func f;
  Var x, y;
  f(x, y) = in(x * 2, y) + in(x * 2 + 1, y - 3);
  f.infer_input_bounds({10, 5});
  Buffer<int> required = in.get();
  EXPECT_EQ(required.dim(0).min(), 0);
  EXPECT_EQ(required.dim(0).extent(), 20);
  EXPECT_EQ(required.dim(1).min(), -3);
  EXPECT_EQ(required.dim(1).extent(), 8);
}

TEST(HalideCompat, EvaluateAndLambda) {
  Var x;
  RDom r(0, 10);
  EXPECT_EQ(evaluate<int>(sum(r * r)), 285);
  EXPECT_FLOAT_EQ(evaluate<float>(pow(Expr(2.0f), 0.5f)), std::sqrt(2.0f));
  Buffer<int> squares = lambda(x, x * x).realize({5});
  EXPECT_EQ(squares(4), 16);
  int a = 0;
  float b = 0;
  evaluate(Tuple(Expr(3) + 4, Expr(1.5f)), &a, &b);
  EXPECT_EQ(a, 7);
  EXPECT_EQ(b, 1.5f);
}

TEST(HalideCompat, TargetsTypesAndErrors) {
  Target target = get_jit_target_from_environment();
  EXPECT_TRUE(target.arch == Target::X86 || target.arch == Target::ARM);
  EXPECT_GE(target.natural_vector_size<float>(), 4);
  EXPECT_TRUE(Float(32).is_float() && UInt(8).bits() == 8 && Int(16).with_lanes(4).lanes() == 4);
  Func f("f_error");
  Var x("x");
  f(x) = x;
  EXPECT_THROW(f.vectorize(Var("q"), 4), CompileError);
  EXPECT_THROW(f.realize({1, 2}), RuntimeError);
  EXPECT_THROW(f.realize({1, 2}), Halide::Error);
  EXPECT_TRUE(Halide::exceptions_enabled());
  Runtime::Buffer<float> both_namespaces_name_it(3);
  EXPECT_EQ(both_namespaces_name_it.width(), 3);
}

TEST(HalideCompat, ConciseCastsAndBits) {
  using namespace Halide::ConciseCasts;
  Var x;
  Func f;
  f(x) = u8_sat(i16(x) * 100 - 50) ^ u8(x << 1);
  Buffer<uint8_t> result = f.realize({6});
  for (int i = 0; i < 6; i++) {
    EXPECT_EQ(result(i), static_cast<uint8_t>(std::clamp(i * 100 - 50, 0, 255) ^ (i << 1)));
  }
}

TEST(HalideCompat, PipelinesWithSeveralOutputs) {
  Var x("x"), y("y");
  Func f("f_out"), g("g_out"), shared("shared");
  shared(x, y) = cast<float>(x * y);
  f(x, y) = shared(x, y) + 1;
  g(x, y) = cast<uint8_t>(clamp(shared(x, y), 0, 255));
  shared.compute_root();
  Pipeline p({f, g});
  p.compile_jit();
  Buffer<float> a(8, 8);
  Buffer<uint8_t> b(8, 8);
  p.realize({a, b});
  EXPECT_EQ(a(3, 4), 13.0f);
  EXPECT_EQ(b(7, 7), 49);
  Realization r = p.realize({8, 8});
  Buffer<float> again = r[0];
  EXPECT_EQ(again(3, 4), 13.0f);
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

// Names of targets that no code is generated for compile, and say so when they are used.
TEST(HalideCompat, WhatIsNotGeneratedSaysSo) {
  Var x("x"), y("y");
  Func f("f");
  f(x, y) = x + y;
  const Target target = get_host_target().with_feature(Target::CUDA);
  if (target.has_gpu_feature()) {
    EXPECT_THROW(Func(f).gpu_tile(x, y, Var("bx"), Var("by"), 8, 8), Unsupported);
  }
  try {
    Module(f.compile_to_module({}, "f", target)).compile_to_buffer();
    FAIL();
  } catch (const Unsupported& error) {
    EXPECT_NE(std::string(error.what()).find("\"cuda\""), std::string::npos) << error.what();
  }
  EXPECT_EQ(HALIDE_VERSION_MAJOR, 14);
}

}  // namespace
