// async(): a producer on a thread of its own, with every kind of storage.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <mutex>
#include <set>
#include <thread>

#include "frontend/include/retrograde/retrograde.h"
#include "ir/print.h"
#include "lower/lower.h"
#include "retrograde_runtime.h"
#include "support/errors.h"

namespace {
std::mutex threads_mutex;
std::set<std::thread::id> threads_seen[2];
std::atomic<int> rows_made{0}, largest_lead{0};
}  // namespace

extern "C" __attribute__((visibility("default"))) int async_test_note(int who, int value) {
  const std::lock_guard lock(threads_mutex);
  threads_seen[who].insert(std::this_thread::get_id());
  return value;
}

namespace retrograde {
namespace {

Expr noted(int who, Expr value) {
  return ir::call_extern("async_test_note", Int(32), {Expr(who), std::move(value)});
}

void async(Func& f) {
  f.function()->schedule.async = true;
  f.function()->version++;
}

class Async : public testing::TestWithParam<int> {
 protected:
  void SetUp() override {
    for (auto& seen : threads_seen) seen.clear();
  }
  void limit(Func& f) { f.jit_handlers().thread_limit = GetParam(); }
};
INSTANTIATE_TEST_SUITE_P(Threads, Async, testing::Values(1, 2, 8));

TEST_P(Async, AProducerAtRootRunsOnAnotherThread) {
  Var x("x");
  Func f("f"), g("g"), out("out");
  f(x) = noted(0, x * 2);
  g(x) = noted(1, x + 1);
  out(x) = f(x) + g(x);
  f.compute_root();
  g.compute_root();
  async(f);
  limit(out);
  Buffer<int> result = out.realize({100});
  for (int i = 0; i < 100; i++) ASSERT_EQ(result(i), 3 * i + 1);
  ASSERT_EQ(threads_seen[0].size(), 1u);
  ASSERT_EQ(threads_seen[1].size(), 1u);
  EXPECT_NE(*threads_seen[0].begin(), *threads_seen[1].begin());
}

TEST_P(Async, ParallelLoopsRunInBothBranches) {
  Var x("x"), y("y");
  Func f("f"), g("g"), out("out");
  f(x, y) = x + y;
  g(x, y) = x * y;
  out(x, y) = f(x, y) + g(x, y);
  f.compute_root().parallel(y);
  g.compute_root().parallel(y);
  out.parallel(y);
  async(f);
  async(g);
  limit(out);
  for (int round = 0; round < 20; round++) {
    Buffer<int> result = out.realize({16, 32});
    result.for_each_element([&](int i, int j) { ASSERT_EQ(result(i, j), i + j + i * j); });
  }
}

TEST_P(Async, InsideAParallelLoop) {
  Var x("x"), y("y");
  Func f("f"), out("out");
  f(x, y) = x + y;
  out(x, y) = f(x, y) + f(x + 1, y);
  f.compute_at(out, y);
  out.parallel(y);
  async(f);
  limit(out);
  Buffer<int> result = out.realize({16, 64});
  result.for_each_element([&](int i, int j) { ASSERT_EQ(result(i, j), 2 * (i + j) + 1); });
}

struct Stencil {
  Var x{"x"}, y{"y"};
  Func f{"f"}, out{"out"};
  Stencil() {
    f(x, y) = noted(0, x * 3 + y * 5);
    out(x, y) = f(x, y - 1) + f(x, y) + f(x + 1, y + 1) + noted(1, 0);
    f.store_root().compute_at(out, y);
    async(f);
  }
  void expect(int width, int height) {
    Buffer<int> result = out.realize({width, height});
    result.for_each_element(
        [&](int i, int j) { ASSERT_EQ(result(i, j), 9 * i + 15 * j + 3) << i << " " << j; });
  }
};

TEST_P(Async, ASlidingWindowIsHandedOverRowByRow) {
  Stencil program;
  limit(program.out);
  for (int height : {1, 2, 3, 57}) program.expect(33, height);
  EXPECT_FALSE(threads_seen[0].count(*threads_seen[1].begin()) &&
               threads_seen[1].count(*threads_seen[0].begin()));
}

TEST_P(Async, FoldedStorageIsARingBuffer) {
  for (int rows : {3, 4, 5, 8, 16}) {
    Stencil program;
    program.f.fold_storage(program.y, rows);
    limit(program.out);
    for (int round = 0; round < 3; round++) program.expect(33, 61);
  }
}

TEST_P(Async, AChainOfThreeAsyncFuncs) {
  Var x("x"), y("y");
  Func f("f"), g("g"), h("h"), out("out");
  f(x, y) = x + y;
  g(x, y) = f(x, y - 1) + f(x, y + 1);
  h(x, y) = g(x, y) * 2;
  out(x, y) = h(x, y - 1) + h(x, y + 1);
  for (Func* func : {&f, &g, &h}) {
    func->store_root().compute_at(out, y);
    async(*func);
  }
  limit(out);
  Buffer<int> result = out.realize({20, 40});
  result.for_each_element([&](int i, int j) { ASSERT_EQ(result(i, j), 8 * (i + j)); });
}

// The storage of f lies in the loops common to both branches; only g's branch needs it.
TEST_P(Async, StorageThatOnlyTheProducerNeedsIsAllocatedThereAlone) {
  Var x("x"), y("y"), xo("xo"), xi("xi");
  Func f("f"), g("g"), out("out");
  f(x, y) = x + y;
  g(x, y) = f(x, y) + 1;
  out(x, y) = g(x, y) * 2;
  out.split(x, xo, xi, 8);
  f.store_at(out, xo).compute_at(g, x);
  g.store_at(out, y).compute_at(out, xo);
  async(g);
  limit(out);
  Buffer<int> result = out.realize({20, 40});
  result.for_each_element([&](int i, int j) { ASSERT_EQ(result(i, j), 2 * (i + j + 1)); });
}

TEST_P(Async, AnAsyncFuncThatReadsAnotherOfTheSameLoopsInOrder) {
  Var x("x"), y("y");
  Func f("f"), out("out");
  RDom r(0, 3);
  f(x, y) = 1;
  f(x, y) += r * x + y;
  out(x, y) = f(x, y) + f(x, y + 2);
  f.store_root().compute_at(out, y);
  async(f);
  limit(out);
  Buffer<int> result = out.realize({9, 30});
  result.for_each_element([&](int i, int j) { ASSERT_EQ(result(i, j), 2 + 6 * i + 6 * j + 6); });
}

// ---- Funcs that both branches read ----

// out(x, y) = g(x, y) + g(x, y + 1) + f(x, y) over f(x, y) = x + y, g(x, y) = 2 f(x, y) + 1.
int shared_value(int x, int y) { return 5 * (x + y) + 4; }

struct SharedInput {
  Var x{"x"}, y{"y"};
  Func f{"f"}, g{"g"}, out{"out"};
  SharedInput() {
    f(x, y) = x + y;
    g(x, y) = 2 * f(x, y) + 1;
    out(x, y) = g(x, y) + g(x, y + 1) + f(x, y);
    g.store_root().compute_at(out, y).async();
  }
  void expect() {
    for (int height : {1, 2, 33}) {
      Buffer<int> result = out.realize({17, height});
      result.for_each_element(
          [&](int i, int j) { ASSERT_EQ(result(i, j), shared_value(i, j)) << i << " " << j; });
    }
  }
};

TEST_P(Async, AFuncComputedInTheSharedLoopsIsComputedInBothBranches) {
  SharedInput program;
  program.f.compute_at(program.out, program.y);
  limit(program.out);
  program.expect();
}

TEST_P(Async, AFuncStoredBesideTheAsyncOneHasStorageInBothBranches) {
  SharedInput program;
  program.f.store_root().compute_at(program.out, program.y);
  limit(program.out);
  program.expect();
}

// In one loop nest, only the async Func reads `first` and only its consumer reads `second`, or vice
// versa.
TEST_P(Async, FuncsComputedTogetherOfWhichEachBranchReadsOne) {
  for (const auto& [turned, traced] :
       {std::pair(false, false), {true, false}, {false, true}, {true, true}}) {
    Var x("x"), y("y");
    Func first("first"), second("second"), ahead("ahead"), out("out"), copy("copy");
    first(x) = x * 2;
    second(x) = x + 1;
    Func& ours = turned ? second : first;
    Func& theirs = turned ? first : second;
    ahead(x, y) = ours(x) + y;
    out(x, y) = ahead(x, y);
    copy(x) = theirs(x);
    first.compute_root();
    second.compute_root().compute_with(first, x);
    ahead.compute_at(out, y).store_root().async();
    if (traced) {  // trace events come between the two
      first.trace_realizations();
      second.trace_realizations();
    }
    Pipeline both({out, copy});
    both.set_custom_trace([](void*, const halide_trace_event_t*) { return 0; });
    both.jit_handlers().thread_limit = GetParam();
    Buffer<int> rows(16, 8), line(16);
    both.realize({rows, line});
    for (int i = 0; i < 16; ++i) {
      EXPECT_EQ(line(i), turned ? i * 2 : i + 1) << turned;
      for (int j = 0; j < 8; ++j) EXPECT_EQ(rows(i, j), (turned ? i + 1 : i * 2) + j) << turned;
    }
  }
}

TEST_P(Async, AFuncComputedInTheSharedLoopsMayBeHoistedOutOfThem) {
  SharedInput program;
  program.f.compute_at(program.out, program.y).hoist_storage_root();
  limit(program.out);
  program.expect();
}

TEST_P(Async, AFuncComputedInTheSharedLoopsMayBeMemoizedOrAsyncItself) {
  SharedInput memoized, parallel;
  memoized.f.compute_at(memoized.out, memoized.y).memoize();
  parallel.f.compute_at(parallel.out, parallel.y).async();
  for (SharedInput* program : {&memoized, &parallel}) {
    limit(program->out);
    program->expect();
  }
}

TEST_P(Async, TwoBranchesReadAThirdAsyncFunc) {
  SharedInput program;
  program.f.store_root().compute_at(program.out, program.y).async();
  limit(program.out);
  for (int round = 0; round < 5; round++) program.expect();
}

// Reads used to come after the wait until they ran on their own thread: those of `out` after those
// of `g`, and those of `g` after those of `between`.
TEST_P(Async, EachBranchThatReadsAnAsyncFuncWaitsForIt) {
  for (bool is_between : {false, true}) {
    Var x("x"), y("y");
    RDom r(0, 200), i(0, 40);
    Func f("f"), between("between"), g("g"), out("out");
    f(x) = 0;
    f(x) += (x * r) % 7;
    between(x) = f(x) + 1;
    g(x) = f(x) + 2;
    out(x) = 0;
    if (is_between) out(x) += between(x);
    out(x) += 3 * f(x);
    out(i) += g(i);
    for (Func* func : {&f, &between, &g}) func->compute_root();
    async(f);
    async(g);
    limit(out);
    for (int run = 0; run < 30; ++run) {
      const Buffer<int> result = out.realize({40});
      for (int v = 0; v < 40; ++v) {
        int sum = 0;
        for (int k = 0; k < 200; ++k) sum += v * k % 7;
        ASSERT_EQ(result(v), is_between ? 5 * sum + 3 : 4 * sum + 2) << v << " " << is_between;
      }
    }
  }
}

TEST_P(Async, ThreeBranchesReadAFoldedAsyncFunc) {
  Var x("x"), y("y");
  Func f("f"), g("g"), h("h"), out("out");
  f(x, y) = x + y;
  g(x, y) = f(x, y) * 2;
  h(x, y) = f(x, y) * 3 + g(x, y);
  out(x, y) = f(x, y) + g(x, y + 1) + h(x, y);
  for (Func* func : {&f, &g, &h}) func->store_root().compute_at(out, y).async();
  for (Func* func : {&f, &g}) func->fold_storage(y, 4);
  limit(out);
  for (int round = 0; round < 5; round++) {
    Buffer<int> result = out.realize({19, 60});
    result.for_each_element(
        [&](int i, int j) { ASSERT_EQ(result(i, j), 8 * (i + j) + 2) << i << " " << j; });
  }
}

// f is computed once, before the loops in which g runs ahead of its consumer.
TEST_P(Async, BranchesInLoopsReadAnAsyncFuncThatIsComputedBeforeThem) {
  SharedInput program;
  program.f.compute_root().async();
  limit(program.out);
  for (int round = 0; round < 20; round++) program.expect();
}

TEST_P(Async, AMemoizedAsyncFuncWaitsForWhatItReads) {
  for (int round = 0; round < 20; round++) {
    Var x("x");
    Func f("f"), g("g"), out("out");
    f(x) = x * 2;
    g(x) = f(x) + 1;
    out(x) = g(x) + f(x);
    f.compute_root().async();
    g.compute_root().async().memoize();
    limit(out);
    for (const int min : {0, 7}) {
      Buffer<int> result(std::vector<int>{1000});
      result.set_min({min});
      out.realize(result);
      for (int i = min; i < min + 1000; i++) ASSERT_EQ(result(i), 4 * i + 1);
    }
  }
}

// The second call finds g in the cache, so nothing would consume f.
TEST(AsyncErrors, LoopsOfAMemoizedFunc) {
  Var x("x"), y("y");
  Func f("async_of_memoized"), g("memoized"), out("out");
  f(x, y) = x + y;
  g(x, y) = f(x, y) * 2;
  out(x, y) = g(x, y) + 1;
  f.store_root().compute_at(g, y).async();
  g.compute_root().memoize();
  expect_error<Unsupported>(
      {"\"async_of_memoized\" async", "always run", "\"memoized\", which is memoized", "Store"},
      [&] {
        out.realize({8, 8});
      });
  f.store_at(g, y);
  for (int round = 0; round < 2; ++round) {
    Buffer<int> result = out.realize({8, 8});
    EXPECT_EQ(result(3, 4), 15);
  }
}

TEST_P(Async, StorageMayBeHoisted) {
  for (const bool slides : {false, true}) {
    Var x("x"), y("y"), yo("yo"), yi("yi");
    Func f("f"), out("out");
    f(x, y) = x + 2 * y;
    out(x, y) = f(x, y) + f(x, y + 1);
    out.split(y, yo, yi, 4);
    if (slides) {
      f.store_at(out, yo).compute_at(out, yi);
    } else {
      f.compute_at(out, yo);
    }
    f.hoist_storage_root().async();
    limit(out);
    Buffer<int> result = out.realize({13, 23});
    result.for_each_element(
        [&](int i, int j) { ASSERT_EQ(result(i, j), 2 * i + 4 * j + 2) << i << " " << j; });
  }
}

// f keeps its rows over the loop over tiles, g only inside a tile, but f has a single storage.
// rule: what an async Func and its consumer both read is stored no further out than the async Func
TEST(AsyncErrors, AFuncThatBothBranchesReadAndThatIsStoredFurtherOut) {
  Var x("x"), y("y"), yo("yo"), yi("yi");
  Func f("f"), g("g"), out("out");
  f(x, y) = x + y;
  g(x, y) = f(x, y) * 2;
  out(x, y) = f(x, y) + g(x, y) + g(x, y + 1);
  out.split(y, yo, yi, 4);
  f.store_root().compute_at(out, yi);
  g.store_at(out, yo).compute_at(out, yi).async();
  try {
    out.realize({8, 16});
    FAIL() << "nothing was thrown";
  } catch (const UserError& error) {
    const std::string message = error.what();
    expect_mentions(message, {"compute \"" + g.name() + "\" async",
                              "\"" + f.name() + "\" is computed in these loops and stored around"});
  }
}

TEST(AsyncErrors, LoopsBetweenStorageAndComputationThatAreNotSerial) {
  Var x("x"), y("y"), yo("yo"), yi("yi");
  Func f("f"), out("out");
  f(x, y) = x + y;
  out(x, y) = f(x, y) + f(x, y + 1);
  out.split(y, yo, yi, 4).unroll(yi);
  f.store_at(out, yo).compute_at(out, yi).async();
  expect_error<Unsupported>({"compute \"f", "async", "are serial", "the loop \"yi\" of \"out",
                             "is not", "Store the Func inside of that loop"},
                            [&] {
                              out.realize({8, 16});
                            });
}

// ---- failures ----

// The first consumer is skipped when its result is in the cache; the second one must still wait.
TEST_P(Async, WhatAMemoizedFuncReadsIsWaitedForWithoutIt) {
  Var x("x");
  Func f("f"), g("g"), out("out");
  f(x) = x * 2;
  g(x) = f(x) + 1;
  out(x) = g(3) + f(x);
  f.compute_root().async();
  g.compute_root().memoize();
  limit(out);
  for (const int min : {0, 7, 14}) {
    Buffer<int> result(std::vector<int>{1000});
    result.set_min({min});
    out.realize(result);
    for (int i = min; i < min + 1000; i++) ASSERT_EQ(result(i), 7 + 2 * i);
  }
}

TEST_P(Async, AnErrorOfTheProducerReleasesTheConsumer) {
  Var x("x"), y("y");
  for (bool folded : {false, true}) {
    Param<int> bad("bad");
    Func f("f"), out("out");
    f(x, y) = require(y != bad, x + y, "row", y, "is broken");
    out(x, y) = f(x, y) + f(x, y + 1);
    f.store_root().compute_at(out, y);
    if (folded) f.fold_storage(y, 2);
    async(f);
    limit(out);
    bad.set(17);
    expect_error<RuntimeError>({"row 17 is broken"}, [&] { out.realize({8, 40}); });
  }
}

// A Func that the async producer and its consumer both read is computed in both branches; each
// branch checks its storage bound.
TEST_P(Async, RoomForWhatBothBranchesReadIsCheckedInBoth) {
  Var x("x");
  Func shared("shared"), f("f"), out("out");
  shared(x) = x;
  f(x) = shared(x) + shared(x + 1);
  out(x) = f(x) + shared(x);
  shared.compute_root().bound_storage(x, 8);
  f.store_root().compute_at(out, x);
  async(f);
  limit(out);
  for (const Target& target :
       {get_host_target(), get_host_target().with_feature(Target::CheckedAccesses)}) {
    expect_error<RuntimeError>({"bounded to 8 coordinates, but 101 are needed"},
                               [&] { out.realize({100}, target); });
  }
}

TEST_P(Async, AnErrorOfTheConsumerReleasesTheProducer) {
  Var x("x"), y("y");
  Func f("f"), out("out");
  f(x, y) = x + y;
  out(x, y) = require(f(x, y) + f(x, y + 1) < 50, f(x, y), "too large");
  f.store_root().compute_at(out, y);
  f.fold_storage(y, 2);
  async(f);
  limit(out);
  expect_error<RuntimeError>({"too large"}, [&] { out.realize({8, 400}); });
}

}  // namespace
}  // namespace retrograde
