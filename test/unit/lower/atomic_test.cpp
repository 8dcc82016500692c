// atomic(): parallel and vectorized reductions whose iterations update the same elements.
#include <gtest/gtest.h>

#include <algorithm>
#include <thread>

#include "frontend/include/retrograde/retrograde.h"
#include "frontend/language/func.h"
#include "ir/equal.h"
#include "ir/parse.h"
#include "ir/print.h"
#include "lower/statement_passes.h"

namespace retrograde {
namespace {

constexpr int bins = 16, points = 10000;

Buffer<int> indices() {
  Buffer<int> in(points);
  for (int i = 0; i < points; i++) in(i) = static_cast<int>((int64_t{i} * i + 7 * i) % bins);
  return in;
}

// Runs the loop over the reduction variable `index` as `type`, with atomic().
void atomic(Func& f, ForType type, int index = 0) {
  graph::Definition& update = f.function()->updates[0];
  update.schedule.atomic = true;
  update.schedule.is_given = true;
  update.schedule.dims[static_cast<size_t>(index)].runs = type;
  f.function()->version++;
}

template <typename T>
void expect_exact_histogram(const std::function<Expr(Expr, Expr)>& combine, T start,
                            const std::function<T(T, T)>& reference) {
  Buffer<int> in = indices();
  std::vector<T> expected(bins, start);
  for (int i = 0; i < points; i++)
    expected[in(i)] = reference(expected[in(i)], static_cast<T>(i % 97));
  for (int threads : {1, 2, 3, 8}) {
    Var x("x");
    RDom r(0, points);
    Func f("f");
    f(x) = Expr(start);
    const Expr bin = unsafe_promise_clamped(in(r), 0, bins - 1);
    f(bin) = combine(f(bin), cast(type_of<T>(), r % 97));
    atomic(f, ForType::Parallel);
    f.jit_handlers().thread_limit = threads;
    Buffer<T> out = f.realize({bins});
    for (int i = 0; i < bins; i++)
      ASSERT_EQ(out(i), expected[i]) << "bin " << i << ", " << threads << " threads";
  }
}

const std::function<Expr(Expr, Expr)> sum = [](Expr a, Expr b) { return a + b; };
const std::function<Expr(Expr, Expr)> product = [](Expr a, Expr b) { return a * (b + 1); };

TEST(Atomic, SumsOfEveryIntegerWidthAreExact) {
  expect_exact_histogram<int32_t>(sum, 5, [](int32_t a, int32_t b) { return a + b; });
  expect_exact_histogram<uint8_t>(sum, 1, [](uint8_t a, uint8_t b) { return uint8_t(a + b); });
  expect_exact_histogram<int16_t>(sum, 1, [](int16_t a, int16_t b) { return int16_t(a + b); });
  expect_exact_histogram<uint64_t>(sum, 1, [](uint64_t a, uint64_t b) { return a + b; });
}

TEST(Atomic, DifferencesMinimaAndMaximaAreExact) {
  const std::function<Expr(Expr, Expr)> difference = [](Expr a, Expr b) { return a - b; };
  const std::function<Expr(Expr, Expr)> least = [](Expr a, Expr b) { return min(a, b - 50); };
  const std::function<Expr(Expr, Expr)> largest = [](Expr a, Expr b) { return max(b, a); };
  expect_exact_histogram<int32_t>(difference, 5, [](int32_t a, int32_t b) { return a - b; });
  expect_exact_histogram<int32_t>(least, 5,
                                  [](int32_t a, int32_t b) { return std::min(a, b - 50); });
  expect_exact_histogram<uint32_t>(largest, 5,
                                   [](uint32_t a, uint32_t b) { return std::max(a, b); });
}

TEST(Atomic, BitwiseOperatorsAreExact) {
  expect_exact_histogram<uint32_t>([](Expr a, Expr b) { return a ^ b; }, 9u,
                                   [](uint32_t a, uint32_t b) { return a ^ b; });
  expect_exact_histogram<uint16_t>([](Expr a, Expr b) { return a | b; }, uint16_t{0},
                                   [](uint16_t a, uint16_t b) { return uint16_t(a | b); });
  expect_exact_histogram<uint64_t>([](Expr a, Expr b) { return a & ~b; }, ~uint64_t{0},
                                   [](uint64_t a, uint64_t b) { return a & ~b; });
}

TEST(Atomic, OperationsWithoutAnInstructionAreExact) {
  expect_exact_histogram<uint32_t>(product, 1u, [](uint32_t a, uint32_t b) { return a * (b + 1); });
  expect_exact_histogram<int64_t>([](Expr a, Expr b) { return (a + b) % 1000003; }, int64_t{3},
                                  [](int64_t a, int64_t b) { return (a + b) % 1000003; });
  expect_exact_histogram<bool>([](Expr a, Expr b) { return a || b; }, false,
                               [](bool a, bool b) { return a || b; });
  // Sums of small integers in floating point do not depend on the order.
  expect_exact_histogram<float>(sum, 0.f, [](float a, float b) { return a + b; });
  expect_exact_histogram<double>(sum, 0.0, [](double a, double b) { return a + b; });
}

TEST(Atomic, AChainOfOneOperationIsOneUpdate) {
  expect_exact_histogram<int32_t>([](Expr a, Expr b) { return 3 + (a - b) + 2 * b; }, 0,
                                  [](int32_t a, int32_t b) { return a + 3 + b; });
}

TEST(Atomic, TuplesAreUpdatedAsOne) {
  Buffer<int> in = indices();
  std::vector<int> best(bins, -1), at(bins, -1);
  auto value = [](int i) { return (i * 7919) % 30011; };
  for (int i = 0; i < points; i++) {
    if (value(i) > best[in(i)]) best[in(i)] = value(i), at[in(i)] = i;
  }
  for (int threads = 1; threads <= 8; threads++) {
    Var x("x");
    RDom r(0, points);
    Func f("f");
    f(x) = Tuple(-1, -1);
    const Expr bin = unsafe_promise_clamped(in(r), 0, bins - 1), v = (r * 7919) % 30011;
    f(bin) = Tuple(max(f(bin)[0], v), select(v > f(bin)[0], r, f(bin)[1]));
    atomic(f, ForType::Parallel);
    f.jit_handlers().thread_limit = threads;
    Realization out = f.realize({bins});
    Buffer<int> values = out[0], places = out[1];
    for (int i = 0; i < bins; i++) {
      ASSERT_EQ(values(i), best[i]) << threads << " threads";
      ASSERT_EQ(places(i), at[i]) << threads << " threads";
    }
  }
}

// Lanes of one vector update the same element.
TEST(Atomic, VectorizedUpdatesWithConflictingLanesAreExact) {
  Buffer<int> in = indices();
  std::vector<int> expected(bins, 0);
  for (int i = 0; i < points; i++) expected[in(i)] += i % 97;
  Var x("x");
  RVar ro("ro"), ri("ri");
  RDom r(0, points);
  Func f("f");
  f(x) = 0;
  const Expr bin = unsafe_promise_clamped(in(r), 0, bins - 1);
  f(bin) += r % 97;
  f.update().split(r, ro, ri, 8);
  atomic(f, ForType::Vectorized, 0);
  atomic(f, ForType::Parallel, 1);
  Buffer<int> out = f.realize({bins});
  for (int i = 0; i < bins; i++) EXPECT_EQ(out(i), expected[i]) << i;
}

// Pairs of neighbouring lanes update the same element, at an index with a pattern that passes might
// exploit.
TEST(Atomic, LanesThatMeetInPairsAreExact) {
  constexpr int width = 4, height = 6;
  Var x("x");
  RVar t("t"), outer("outer"), lanes("lanes");
  RDom r(0, width, 0, height);
  Func f("f");
  f(x) = cast<int8_t>(1);
  f(r.y) += cast<int8_t>(r.x + 1);
  f.update().fuse(r.x, r.y, t).split(t, outer, lanes, 8).atomic().vectorize(lanes).parallel(outer);
  Buffer<int8_t> out = f.realize({height});
  for (int i = 0; i < height; i++) EXPECT_EQ(out(i), 1 + width * (width + 1) / 2) << i;
}

// All lanes update one element: they are added up first.
TEST(Atomic, OneElementTakesVectorsFromAllThreads) {
  for (int threads : {1, 2, 8}) {
    RVar ro("ro"), ri("ri");
    RDom r(0, 1000);
    Func f("f");
    f() = cast<int64_t>(3);
    f() += cast<int64_t>(r * r);
    f.update().split(r, ro, ri, 8);
    atomic(f, ForType::Vectorized, 0);
    atomic(f, ForType::Parallel, 1);
    f.jit_handlers().thread_limit = threads;
    Buffer<int64_t> out = f.realize();
    EXPECT_EQ(out(), 3 + int64_t{999} * 1000 * 1999 / 6);
  }
}

TEST(Atomic, VectorizedOverPointsAndParallelOverTheReduction) {
  constexpr int width = 37, rows = 50;
  Var x("x");
  RDom r(0, rows);
  for (bool chain : {false, true}) {
    Var xo("xo"), xi("xi");
    Func f("f");
    f(x) = 1;
    f(x) = chain ? f(x) * 3 + x * min(r, 1 + x * x) : f(x) + x * r;
    graph::Definition& update = f.function()->updates[0];
    f.update().split(x, xo, xi, 8, TailStrategy::GuardWithIf).reorder(xi, r, xo).vectorize(xi);
    update.schedule.atomic = true;
    for (graph::Dim& dim : update.schedule.dims) {
      if (dim.is_reduction && !chain) dim.runs = ForType::Parallel;
    }
    Buffer<int> out = f.realize({width});
    for (int i = 0; i < width; i++) {
      unsigned expected = 1;
      for (int k = 0; k < rows; k++)
        expected = chain ? expected * 3 + static_cast<unsigned>(i * std::min(k, 1 + i * i))
                         : expected + static_cast<unsigned>(i * k);
      ASSERT_EQ(out(i), static_cast<int>(expected)) << i;
    }
  }
}

// Each element gets the same value from all its iterations, so their order does not matter.
TEST(Atomic, OneValueMayBeStoredInAnyOrder) {
  Buffer<int> in = indices();
  Var x("x"), b("b");
  RVar ro("ro"), ri("ri");
  for (const bool has_two : {false, true}) {
    RDom r(0, points);
    Func f("f");
    const Expr bin = unsafe_promise_clamped(in(r), 0, bins - 1);
    if (has_two) {
      f(b, x) = Tuple(-1, -1);
      f(bin, x) = Tuple(x * x, x);
    } else {
      f(b, x) = -1;
      f(bin, x) = x * x;
    }
    f.update().split(r, ro, ri, 8).reorder(ro, x, ri).atomic().parallel(ri).parallel(x);
    if (!has_two) f.update().vectorize(ro);
    Realization result = f.realize({bins, 5});
    Buffer<int> first = result[0];
    std::vector<bool> is_hit(bins);
    for (int i = 0; i < points; i++) is_hit[static_cast<size_t>(in(i))] = true;
    for (int i = 0; i < bins; i++)
      for (int j = 0; j < 5; j++)
        EXPECT_EQ(first(i, j), is_hit[static_cast<size_t>(i)] ? j * j : -1) << i << " " << j;
  }
  Func g("g");
  RDom r(0, points);
  g(x) = 0;
  g(clamp(in(r), 0, bins - 1)) = r;
  EXPECT_THROW(g.update().atomic().parallel(r), CompileError) << "the last one wins";
}

TEST(Atomic, AllocationsInsideTheLoopNeedNoAtomic) {
  const auto expect_lowered = [](const std::string& before, const std::string& after) {
    const Stmt found = lower::lower_atomics(ir::parse_stmt(before));
    EXPECT_TRUE(ir::equal(found, ir::parse_stmt(after))) << ir::print(found);
  };
  expect_lowered(
      "parallel for (i, 0, 8) { allocate f[int64(4)]:int32 auto { atomic f { f[0] = f[0] + i } } }",
      "parallel for (i, 0, 8) { allocate f[int64(4)]:int32 auto { f[0] = f[0] + i } }");
  expect_lowered(
      "allocate f[int64(4)]:int32 auto { parallel for (i, 0, 8) { "
      "atomic f { let t = i * 3 let u = f[0] + t f[0] = u * u } } }",
      "allocate f[int64(4)]:int32 auto { parallel for (i, 0, 8) { "
      "let t = i * 3 atomic f { f[0] = (f[0] + t) * (f[0] + t) } } }");
}

}  // namespace
}  // namespace retrograde
