// Funcs that nothing reads are not computed; the tests count calls, trace events and lookups.
#include <gtest/gtest.h>

#include <atomic>

#include "frontend/include/retrograde/retrograde.h"
#include "retrograde_runtime.h"

namespace {
std::atomic<int> calls[4];
}

extern "C" __attribute__((visibility("default"))) int count_skip_stages_calls(int which,
                                                                              int value) {
  calls[which]++;
  return value;
}
extern "C" __attribute__((visibility("default"))) int skip_stages_fill(halide_buffer_t* out) {
  if (out->host == nullptr) return 0;
  calls[3]++;
  for (int i = 0; i < out->dim[0].extent; i++)
    reinterpret_cast<int32_t*>(out->host)[i * out->dim[0].stride] = 100 + out->dim[0].min + i;
  return 0;
}

namespace retrograde {
namespace {

Expr counted(int which, Expr value) {
  return ir::call_extern("count_skip_stages_calls", Int(32), {Expr(which), std::move(value)});
}

class SkipStages : public testing::Test {
 protected:
  Var x{"x"}, y{"y"};
  Param<bool> p{"p"}, q{"q"};
  Param<int> n{"n"};
  Func a{"a"}, b{"b"}, c{"c"}, out{"out"};

  void SetUp() override {
    p.set(false);
    q.set(false);
    n.set(0);
  }
  // The number of calls while each Func was computed.
  void expect_calls(const std::vector<int>& expected) {
    for (size_t i = 0; i < expected.size(); i++) EXPECT_EQ(calls[i], expected[i]) << "Func " << i;
  }
  Buffer<int> run(const std::vector<int>& sizes) {
    for (auto& count : calls) count = 0;
    return out.realize(sizes);
  }
};

TEST_F(SkipStages, OnlyTheArmThatAParameterChooses) {
  a(x) = counted(0, x);
  b(x) = counted(1, x * 2);
  out(x) = select(p, a(x), b(x));
  a.compute_root();
  b.compute_root();
  Buffer<int> found = run({10});
  expect_calls({0, 10});
  EXPECT_EQ(found(7), 14);
  p.set(true);
  found = run({10});
  expect_calls({10, 0});
  EXPECT_EQ(found(7), 7);
}

TEST_F(SkipStages, WhatOnlyASkippedFuncReads) {
  a(x) = counted(0, x);
  b(x) = counted(1, a(x) + 1);
  c(x) = counted(2, a(x - 1) + 2);
  out(x) = select(p, b(x), 0) + select(q, c(x), 0);
  for (Func* f : {&a, &b, &c}) f->compute_root();
  run({10});
  expect_calls({0, 0, 0});
  q.set(true);
  Buffer<int> found = run({10});
  expect_calls({11, 0, 10});
  EXPECT_EQ(found(3), 4);
  p.set(true);
  found = run({10});
  expect_calls({11, 10, 10});
  EXPECT_EQ(found(3), 8);
}

TEST_F(SkipStages, WhatOnlyASkippedFuncThatIsStoredFurtherOutReads) {
  Var xo("xo"), xi("xi");
  a(x) = counted(0, x);
  b(x) = counted(1, a(x) + 1);
  c(x) = counted(2, b(x) + 2);
  Func d("d");
  d(x) = a(x) + 5;
  out(x) = select(p, c(x), 0) + select(q, d(x), 0);
  out.split(x, xo, xi, 5);
  a.compute_at(out, xo);
  b.compute_at(out, xo);
  c.store_root().compute_at(out, xo);
  d.store_at(out, xo).compute_at(out, xi);
  for (const bool wants_c : {false, true}) {
    for (const bool wants_d : {false, true}) {
      p.set(wants_c);
      q.set(wants_d);
      Buffer<int> found = run({10});
      expect_calls({wants_c || wants_d ? 10 : 0, wants_c ? 10 : 0, wants_c ? 10 : 0});
      for (int i = 0; i < 10; i++)
        EXPECT_EQ(found(i), (wants_c ? i + 3 : 0) + (wants_d ? i + 5 : 0)) << i;
    }
  }
}

TEST_F(SkipStages, WhatIsReadUnderOppositeConditions) {
  a(x) = counted(0, x);
  b(x) = counted(1, select(p, a(x), x));
  out(x) = select(p, x, b(x));
  a.compute_root();
  b.compute_root();
  for (const bool value : {false, true}) {
    p.set(value);
    Buffer<int> found = run({10});
    expect_calls({0, value ? 0 : 10});
    EXPECT_EQ(found(4), 4);
  }
}

TEST_F(SkipStages, TuplesUpdatesAndReductionsUnderPredicates) {
  a(x) = Tuple(counted(0, x), x + 1);
  a(x) = Tuple(a(x)[0] + 1, counted(1, a(x)[1]));
  RDom r(0, 5);
  r.where(p);
  out(x) = 0;
  out(x) += a(r)[1];
  a.compute_root();
  EXPECT_EQ(run({3})(1), 0);
  expect_calls({0, 0});
  p.set(true);
  EXPECT_EQ(run({3})(1), 15);
  expect_calls({5, 5});
}

TEST_F(SkipStages, RowsByAConditionOnTheLoopAround) {
  a(x, y) = counted(0, x + y);
  out(x, y) = select(y < n, a(x, y) + a(x + 1, y), -1);
  a.compute_at(out, y);
  n.set(3);
  Buffer<int> found = run({4, 10});
  expect_calls({15});
  EXPECT_EQ(found(2, 2), 9);
  EXPECT_EQ(found(2, 3), -1);
}

TEST_F(SkipStages, StepsOfAReductionThatIsNoBox) {
  RDom r(0, 4, 0, 6);
  r.where(r.y < n);
  a(x, y) = counted(0, x * y);
  out(x) = 0;
  out(x) += a(x + r.x, r.y);
  a.compute_at(out, r.y);
  n.set(2);
  Buffer<int> found = run({1});
  expect_calls({8});
  EXPECT_EQ(found(0), 6);
}

TEST_F(SkipStages, PointsOfAReductionThatIsNoBox) {
  RDom r(0, 10, 0, 10);
  r.where(r.x * r.x + r.y * r.y < 25);
  a(x, y) = counted(0, x + y);
  out(x) = 0;
  out(x) += a(r.x, r.y);
  a.compute_at(out, r.x);
  run({1});
  expect_calls({22});
}

TEST_F(SkipStages, SumsThatAreWantedInPlaces) {
  RDom r(0, 5);
  a(x) = 0;
  a(x) += counted(0, x + r);
  out(x) = select(x > 3 && x < 7, a(x), 0);
  EXPECT_EQ(run({20})(5), 35);
  expect_calls({15});
  a.compute_at(out, x);
  EXPECT_EQ(run({20})(5), 35);
  expect_calls({15});
}

// The condition is the result of the C function, which the select calls anyway.
TEST_F(SkipStages, ConvolutionsThatAreWantedWhereAFunctionSaysSo) {
  RDom r(0, 5);
  out(x) = select(counted(0, x % 3) > 0, sum(counted(1, x + r)), 0);
  EXPECT_EQ(run({30})(4), 4 + 5 + 6 + 7 + 8);
  EXPECT_EQ(calls[0], 30);
  EXPECT_EQ(calls[1], 20 * 5);
}

TEST_F(SkipStages, WindowsInTheLoopsOfAFuncThatIsReadInPlaces) {
  a(x) = counted(0, x);
  b(x) = a(x) + a(x - 1);
  out(x) = select(x == 5, 0, b(x));
  a.store_root().compute_at(b, x);
  b.compute_at(out, x);
  const Buffer<int> found = run({10});
  for (int i = 0; i < 10; i++) EXPECT_EQ(found(i), i == 5 ? 0 : 2 * i - 1);
}

TEST_F(SkipStages, WindowsThatSlideAreComputedInAllIterationsOrNone) {
  a(x, y) = counted(0, x + y);
  out(x, y) = select(p && y > 2, a(x, y) + a(x, y + 1), 0);
  a.store_root().compute_at(out, y);
  run({4, 10});
  expect_calls({0});
  p.set(true);
  EXPECT_EQ(run({4, 10})(1, 5), 13);
  expect_calls({44});
}

TEST_F(SkipStages, TheSideOfAConcatenationThatIsNotWanted) {
  a(x) = counted(0, x);
  b(x) = counted(1, 2 * x);
  out(x) = select(x < n, a(x), b(x - n));
  a.compute_root();
  b.compute_root();
  for (const bool is_vectorized : {false, true}) {
    if (is_vectorized) out.vectorize(x, 4);
    n.set(10);
    EXPECT_EQ(run({10})(9), 9);
    expect_calls({10, 0});
    n.set(0);
    EXPECT_EQ(run({10})(9), 18);
    expect_calls({0, 10});
    n.set(4);
    EXPECT_EQ(run({10})(9), 10);
    EXPECT_GT(calls[0], 0);
    EXPECT_GT(calls[1], 0);
  }
}

TEST_F(SkipStages, SpecializationsReadWhatTheyRead) {
  a(x) = counted(0, x);
  out(x) = select(p, a(x), 5);
  a.compute_root();
  out.specialize(p).vectorize(x, 4);
  EXPECT_EQ(run({8})(3), 5);
  expect_calls({0});
  p.set(true);
  EXPECT_EQ(run({8})(3), 3);
  expect_calls({8});
}

TEST_F(SkipStages, CFunctionsThatComputeAFunc) {
  a.define_extern("skip_stages_fill", {}, Int(32), 1);
  out(x) = select(p, a(x), 5);
  a.compute_root();
  EXPECT_EQ(run({8})(3), 5);
  EXPECT_EQ(calls[3], 0);
  p.set(true);
  EXPECT_EQ(run({8})(3), 103);
  EXPECT_EQ(calls[3], 1);
}

TEST_F(SkipStages, MemoizedFuncsAreLookedUpWhereTheyAreRead) {
  a(x) = counted(0, x);
  out(x) = select(p, a(x), 5);
  a.compute_root().memoize();
  retrograde_memoization_cleanup();
  bool was_computed = false;
  for (const bool value : {false, true, false, true}) {
    p.set(value);
    const bool is_first = value && !was_computed;
    EXPECT_EQ(run({8})(3), value ? 3 : 5);
    expect_calls({is_first ? 8 : 0});
    was_computed |= value;
  }
  retrograde_memoization_cleanup();
}

// ---- Funcs that must still be computed ----

// Both arms of a select are evaluated: values that were not computed must not be used as addresses.
TEST_F(SkipStages, RowsByAValueThatIsComputedBefore) {
  for (const bool at_root : {true, false}) {
    Func flag("flag"), doubled("doubled");
    out = Func("out");
    RDom r(0, 10);
    const auto input = [&](const Expr& column, const Expr& row) {
      return select(row % 3 == 0 && column == 7, -1, column);
    };
    flag(y) = cast<bool>(false);
    flag(y) = flag(y) || input(r, y) < 0;
    doubled(x, y) = counted(0, input(x, y) * 2);
    out(x, y) = select(flag(y), input(x, y), doubled(x, y));
    doubled.compute_at(out, y);
    at_root ? flag.compute_root() : flag.compute_at(out, y);
    const Buffer<int> result = run({10, 10});
    expect_calls({60});
    result.for_each_element([&](int i, int j) {
      EXPECT_EQ(result(i, j), j % 3 != 0 ? i * 2 : i == 7 ? -1 : i);
    });
  }
}

TEST_F(SkipStages, TilesByAnImageThatMarksThem) {
  Var column("column"), row("row");
  ImageParam marks(Bool(), 2, "marks");
  Func tiles("tiles");
  a(column, row, x, y) = counted(0, x * 40 + column + row);
  tiles(column, row, x, y) = select(marks(x, y), a(column, row, x, y), -1);
  out(x, y) = tiles(x % 4, y % 4, x / 4, y / 4);
  out.bound(x, 0, 12).bound(y, 0, 8).tile(x, y, column, row, 4, 4);
  tiles.compute_at(out, x);
  a.compute_at(tiles, x);
  Buffer<bool> marked(3, 2);
  marked.fill(false);
  marked(1, 0) = marked(2, 1) = true;
  marks.set(marked);
  const Buffer<int> result = run({12, 8});
  expect_calls({2 * 16});
  result.for_each_element([&](int i, int j) {
    EXPECT_EQ(result(i, j), marked(i / 4, j / 4) ? i / 4 * 40 + i % 4 + j % 4 : -1);
  });
}

TEST_F(SkipStages, CoordinatesAreAlwaysComputed) {
  Buffer<int> table(10);
  for (int i = 0; i < 10; i++) table(i) = 10 * i;
  a(x) = counted(0, x % 10);
  out(x) = select(p, table(clamp(a(x), 0, 9)), 0);
  a.compute_root();
  EXPECT_EQ(run({20})(13), 0);
  expect_calls({20});
}

TEST_F(SkipStages, WhatDependsOnValuesIsAlwaysComputed) {
  Buffer<int> mask(10);
  mask.fill(0);
  a(x) = counted(0, x);
  b(x) = counted(1, x);
  out(x) = select(mask(x) > 0, a(x), 0) + select(x < n, b(x), 0);
  a.compute_root();
  b.compute_root();
  run({10});
  expect_calls({10, 10});
}

TEST_F(SkipStages, OutputsAndFuncsThatRunAsync) {
  a(x) = counted(0, x);
  b(x) = counted(1, select(p, a(x), 1));
  out(x) = select(p, b(x), 2);
  a.compute_root();
  b.compute_root().async();
  Buffer<int> found = run({10});
  EXPECT_EQ(found(3), 2);
  for (auto& count : calls) count = 0;
  Buffer<int> second(10), first(10);
  Pipeline({b, out}).realize(Realization({second, first}));
  EXPECT_EQ(calls[1], 10) << "an output";
}

TEST_F(SkipStages, FuncsThatShareLoops) {
  a(x) = counted(0, x);
  b(x) = counted(1, 3 * x);
  out(x) = select(p, a(x), 0) + b(x);
  a.compute_root();
  b.compute_root().compute_with(a, x);
  EXPECT_EQ(run({10})(3), 9);
  EXPECT_EQ(calls[1], 10);
}

}  // namespace
}  // namespace retrograde
