// Reductions over vectorized variables give the values of their declared order: all operators and
// types, lanes and tails, several dimensions, empty domains, and the extremes of paired products.
// Oracles: the interpreter for whole pipelines, plain loops for products. Floats hold integers so
// small that sums are exact in every order.
#include <gtest/gtest.h>

#include <retrograde/retrograde.h>
#include <functional>

#include "testing/interpreter.h"

namespace retrograde {
namespace {

constexpr int width = 45, height = 6;

template <typename T>
Buffer<T> numbers(int w = width, int h = height) {
  Buffer<T> result(w, h);
  result.for_each_element(
      [&](int x, int y) { result(x, y) = static_cast<T>((x * 37 + y * 11 + x * x * y) % 23 - 4); });
  return result;
}

void expect_interpreted(Func f, const std::vector<int>& size) {
  const oracle::Region region{std::vector<int>(size.size(), 0), size};
  const auto expected = oracle::Interpreter().realize(f.function(), region);
  const Realization compiled = f.realize(size);
  for (size_t v = 0; v < expected.size(); v++) {
    const auto actual = oracle::compare(expected[v], *compiled[v].raw_buffer());
    EXPECT_TRUE(actual.agrees()) << actual.first_mismatch;
  }
}

using Step = std::function<Expr(Expr, Expr)>;

const std::vector<std::pair<const char*, Step>> steps = {
    {"sum", [](Expr a, Expr b) { return a + b; }},
    {"difference", [](Expr a, Expr b) { return a - b; }},
    {"product", [](Expr a, Expr b) { return a * cast(a.type(), select(b > 15, 2, 1)); }},
    {"min", [](Expr a, Expr b) { return min(a, b); }},
    {"max", [](Expr a, Expr b) { return max(a, b); }},
};

template <typename T>
void check_every_step() {
  const Buffer<T> in = numbers<T>();
  Var x("x");
  for (const auto& [name, step] : steps) {
    for (const int lanes : {3, 16}) {
      SCOPED_TRACE(testing::Message() << name << ", " << lanes << " lanes of " << type_of<T>());
      RDom r(0, width, "r");
      Func f("f");
      f(x) = cast<T>(x + 1);
      f(x) = step(f(x), in(r, x));
      f.update().atomic().vectorize(r, lanes);
      expect_interpreted(f, {height});
    }
  }
}

TEST(VectorReduction, EveryOperatorOfFloats) {
  check_every_step<float>();
  check_every_step<double>();
}
TEST(VectorReduction, EveryOperatorOfIntegers) {
  check_every_step<int32_t>();
  check_every_step<int64_t>();
  check_every_step<uint16_t>();
}

// The order of the loops, and which of them are vectorized, must not matter.
TEST(VectorReduction, SeveralDimensions) {
  const Buffer<int32_t> in = numbers<int32_t>();
  for (int variant = 0; variant < 5; ++variant) {
    SCOPED_TRACE(variant);
    Var x("x");
    RVar ro("ro"), ri("ri");
    RDom r(0, 40, 0, height, "r");
    Func f("f");
    f(x) = x;
    f(x) += in(r.x + x, r.y) * (r.y + 1);
    Stage update = f.update();
    update.atomic();
    if (variant == 0) update.vectorize(r.x, 8);
    if (variant == 1) update.reorder(x, r.x, r.y).vectorize(x, 4).vectorize(r.x, 8);
    if (variant == 2) update.reorder(r.y, r.x, x).vectorize(r.y, 3);
    if (variant == 3)
      update.split(r.x, ro, ri, 4).reorder(ri, x, ro, r.y).vectorize(ri).vectorize(x, 4);
    if (variant == 4) update.reorder(r.x, x, r.y).vectorize(r.x, 8).unroll(x, 2).parallel(r.y);
    expect_interpreted(f, {5});
  }
}

TEST(VectorReduction, GuardedAndEmptyDomains) {
  const Buffer<int32_t> in = numbers<int32_t>();
  Var x("x");
  for (const int extent : {0, 1, 7, 8, 9, 40}) {
    SCOPED_TRACE(extent);
    Param<int> n("n");
    RDom r(0, n, 0, height, "r");
    r.where(r.y != 3 && r.x % 5 != x);
    Func f("f");
    f(x) = 100 + x;
    f(x) += in(clamp(r.x, 0, width - 1), r.y);
    f.update().atomic().vectorize(r.x, 8);
    n.set(extent);
    expect_interpreted(f, {5});
  }
}

// Two elements of one Func in one loop, and a loop that reads the sums it updates.
TEST(VectorReduction, SumsThatMeetAndSumsThatAreRead) {
  const Buffer<float> in = numbers<float>();
  Var x("x");
  RDom r(0, 40, "r");
  Func both("both"), running("running");
  both(x) = cast<float>(x);
  both(x) += in(r, x);
  both.update().unroll(x, 2).reorder(x, r).atomic().vectorize(r, 8);
  expect_interpreted(both, {4});
  RDom k(0, 5, 0, 8, "k");
  running(x) = 1.0f;
  running(x) += in(k.y, k.x) + select(running(x) > 20.0f, 1.0f, 0.0f);
  expect_interpreted(running, {4});
}

TEST(VectorReduction, TuplesStayRight) {
  const Buffer<int32_t> in = numbers<int32_t>();
  Var x("x");
  RDom r(0, 40, "r");
  Func f("f");
  f(x) = Tuple(0, 1000);
  f(x) = Tuple(f(x)[0] + in(r, x), min(f(x)[1], in(r, x)));
  f.update().atomic().vectorize(r, 8);
  expect_interpreted(f, {height});
}

// ---- products of 16-bit numbers ----

template <typename A, typename B>
void check_products(int lanes) {
  constexpr int size = 77;
  Buffer<A> a(size);
  Buffer<B> b(size);
  for (int i = 0; i < size; ++i) {
    a(i) = static_cast<A>(i * 2731 + 77);
    b(i) = static_cast<B>(i * 3307 + 15);
  }
  // Neighbours with extreme values, whose sums still fit.
  a(0) = a(2) = std::numeric_limits<A>::min();
  b(0) = b(2) = std::numeric_limits<B>::min();
  a(1) = a(3) = std::numeric_limits<A>::max();
  b(1) = b(3) = std::numeric_limits<B>::min();
  for (const int extent : {4, 16, 31, size}) {
    RDom r(0, extent, "r");
    Func f("f");
    f() = 3;
    f() += cast<int>(a(r)) * cast<int>(b(r));
    f.update().atomic().vectorize(r, lanes);
    int64_t expected = 3;
    for (int i = 0; i < extent; ++i) expected += int64_t{a(i)} * b(i);
    const Buffer<int> result = f.realize();
    ASSERT_EQ(result(), static_cast<int32_t>(expected))
        << extent << " products of " << type_of<A>() << " and " << type_of<B>() << ", " << lanes
        << " lanes";
  }
}

TEST(VectorReduction, NarrowProducts) {
  for (const int lanes : {2, 6, 16, 64, 7}) {
    check_products<int16_t, int16_t>(lanes);
    check_products<int16_t, uint8_t>(lanes);
    check_products<int8_t, uint8_t>(lanes);
    check_products<uint8_t, uint8_t>(lanes);
    check_products<uint16_t, int16_t>(lanes);  // does not fit: no pairs
  }
}

// Sums of scaled numbers, with even and odd counts, other terms and factors that do not fit.
TEST(VectorReduction, SumsOfScaledNumbers) {
  const Buffer<int16_t> a = numbers<int16_t>();
  const Buffer<uint8_t> b = numbers<uint8_t>();
  Param<int16_t> k("k");
  k.set(-321);
  Var x("x");
  for (const int lanes : {4, 8, 12, 16, 32}) {
    const auto v = [&](int i) { return cast<int>(a(x + i, 1)); };
    const auto u = [&](int i) { return cast<int>(b(x + i, 2)); };
    const Expr pair = v(0) * 3 + v(1) * -32768;
    const Expr sums[] = {pair,
                         pair + v(2) * 7,
                         (pair + 100) + (u(1) * 255 + v(2) * cast<int>(k)),
                         v(0) * 40000 + v(1) * 5 + v(2) * 6 + x,
                         u(0) * v(1) + u(2) * v(3) + v(0) * 9,
                         (pair + pair) * (pair + u(3) * 2)};
    for (size_t variant = 0; variant < std::size(sums); variant++) {
      SCOPED_TRACE(testing::Message() << lanes << " lanes, sum " << variant);
      Func f("f");
      f(x) = sums[variant];
      f.vectorize(x, lanes, TailStrategy::GuardWithIf);
      expect_interpreted(f, {39});
    }
  }
}

// Factors that are constants, repeated, or one; sums of several lanes.
TEST(VectorReduction, OtherNarrowFactors) {
  const Buffer<int16_t> a = numbers<int16_t>();
  Var x("x");
  for (int variant = 0; variant < 5; ++variant) {
    SCOPED_TRACE(variant);
    RDom r(0, 32, "r");
    const Expr v = cast<int>(a(r, x)), fixed = cast<int>(a(x, 0));
    const Expr terms[] = {v, v * 32767, v * 32768, v * fixed, v * v};
    Func f("f");
    f(x) = x;
    f(x) -= terms[variant];
    RVar ro("ro"), ri("ri");
    f.update().split(r, ro, ri, 8).reorder(ri, x, ro).atomic().vectorize(ri).vectorize(x, 2);
    expect_interpreted(f, {height});
  }
}

}  // namespace
}  // namespace retrograde
