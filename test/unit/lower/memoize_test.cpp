// memoize(): results are computed once for each key, and never stale.
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "frontend/include/retrograde/retrograde.h"
#include "retrograde_runtime.h"
#include "support/errors.h"

namespace {
std::atomic<int> memoize_calls{0};
}

// Counts how often a Func is computed.
extern "C" __attribute__((visibility("default"))) int count_memoize_calls(int value) {
  memoize_calls++;
  return value;
}

namespace retrograde {
namespace {

void memoize(Func& f) {
  f.compute_root();
  f.function()->schedule.memoized = true;
  f.function()->version++;
}

Expr counted(Expr value) {
  return ir::call_extern("count_memoize_calls", Int(32), {std::move(value)});
}

class Memoize : public testing::Test {
 protected:
  void SetUp() override {
    retrograde_memoization_cleanup();
    retrograde_memoization_set_size(0);
    memoize_calls = 0;
  }
};

struct Scaled {
  Param<int> scale{"scale"};
  Var x{"x"};
  Func f{"f"}, out{"out"};
  Scaled() {
    f(x) = counted(x) * scale;
    out(x) = f(x) + f(x + 1);
    memoize(f);
  }
  void expect(int by, int size) {
    scale.set(by);
    Buffer<int> result = out.realize({size});
    for (int i = 0; i < size; i++) ASSERT_EQ(result(i), by * (2 * i + 1)) << i;
  }
};

TEST_F(Memoize, TheSecondCallComputesNothing) {
  Scaled program;
  program.expect(3, 10);
  EXPECT_EQ(memoize_calls, 11);
  program.expect(3, 10);
  EXPECT_EQ(memoize_calls, 11);
}

TEST_F(Memoize, AParameterIsPartOfTheKey) {
  Scaled program;
  for (int round = 0; round < 2; round++) {
    program.expect(3, 10);
    program.expect(4, 10);
    EXPECT_EQ(memoize_calls, 22);
  }
}

TEST_F(Memoize, TheRegionIsPartOfTheKey) {
  Scaled program;
  for (int round = 0; round < 2; round++) {
    program.expect(3, 10);
    program.expect(3, 12);
    EXPECT_EQ(memoize_calls, 11 + 13);
  }
}

TEST_F(Memoize, FuncsOfOneShapeDoNotShareResults) {
  Scaled a, b;
  a.expect(3, 10);
  b.expect(3, 10);
  EXPECT_EQ(memoize_calls, 22);
}

TEST_F(Memoize, TheCacheStaysWithinItsSizeAndForgetsTheOldest) {
  retrograde_memoization_set_size(5000);
  Scaled program;
  for (int by = 0; by < 20; by++) program.expect(by, 200);
  EXPECT_LE(retrograde_memoization_bytes(), 5000);
  EXPECT_GT(retrograde_memoization_bytes(), 1000);
  const int before = memoize_calls;
  program.expect(19, 200);
  EXPECT_EQ(memoize_calls, before);
  program.expect(0, 200);
  EXPECT_EQ(memoize_calls, before + 201);
}

TEST_F(Memoize, AResultLargerThanTheCacheIsComputedAgain) {
  retrograde_memoization_set_size(100);
  Scaled program;
  program.expect(2, 200);
  program.expect(2, 200);
  EXPECT_EQ(memoize_calls, 402);
  EXPECT_EQ(retrograde_memoization_bytes(), 0);
}

TEST_F(Memoize, EvictionForgetsWhatHasTheKey) {
  Scaled a, b;
  a.f.function()->schedule.eviction_key = Expr(uint64_t{7});
  b.f.function()->schedule.eviction_key = Expr(uint64_t{8});
  a.expect(3, 10);
  b.expect(3, 10);
  retrograde_memoization_evict(7);
  b.expect(3, 10);
  EXPECT_EQ(memoize_calls, 22);
  a.expect(3, 10);
  EXPECT_EQ(memoize_calls, 33);
}

TEST_F(Memoize, TuplesAreKeptWhole) {
  Var x("x");
  Func f("f"), out("out");
  f(x) = Tuple(counted(x), cast<uint8_t>(x * 2));
  out(x) = f(x)[0] + cast<int>(f(x)[1]);
  memoize(f);
  for (int round = 0; round < 2; round++) {
    Buffer<int> result = out.realize({20});
    for (int i = 0; i < 20; i++) ASSERT_EQ(result(i), 3 * i);
  }
  EXPECT_EQ(memoize_calls, 20);
}

TEST_F(Memoize, UpdatesBelongToTheResult) {
  Var x("x");
  RDom r(0, 5);
  Func f("f"), out("out");
  f(x) = counted(x);
  f(x) += r;
  out(x) = f(x);
  memoize(f);
  for (int round = 0; round < 3; round++) {
    Buffer<int> result = out.realize({8});
    for (int i = 0; i < 8; i++) ASSERT_EQ(result(i), i + 10);
  }
  EXPECT_EQ(memoize_calls, 8);
}

TEST_F(Memoize, ATagStandsForWhatAnImageHolds) {
  Var x("x");
  ImageParam in(Int(32), 1, "in");
  Param<int> version("version");
  Func f("f"), out("out");
  f(x) = counted(memoize_tag(in(x), version));
  out(x) = f(x);
  memoize(f);
  const auto run = [&](int value, int tag) {
    Buffer<int> data(10);
    data.fill(value);
    in.set(data);
    version.set(tag);
    Buffer<int> result = out.realize({10});
    return result(5);
  };
  EXPECT_EQ(run(4, 1), 4);
  EXPECT_EQ(run(5, 2), 5);
  EXPECT_EQ(run(4, 1), 4);
  EXPECT_EQ(memoize_calls, 20);
  EXPECT_EQ(run(6, 1), 4) << "the tag says that nothing changed";
}

TEST_F(Memoize, ManyThreadsMayLookUpAndStore) {
  retrograde_memoization_set_size(3000);
  Scaled program;
  program.expect(1, 50);
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; t++) {
    threads.emplace_back([t] {
      for (int i = 0; i < 200; i++) {
        const uint8_t key[2] = {static_cast<uint8_t>(t % 2), static_cast<uint8_t>(i % 30)};
        int32_t data[64];
        void* blocks[1] = {data};
        const int64_t bytes[1] = {sizeof data};
        if (retrograde_memoization_lookup(nullptr, key, 2, 1, blocks, bytes) == 0) {
          for (int32_t v : data) ASSERT_EQ(v, key[0] * 100 + key[1]);
        } else {
          for (int32_t& v : data) v = key[0] * 100 + key[1];
          retrograde_memoization_store(nullptr, key, 2, 1, blocks, bytes, 1, key[1]);
        }
        if (i % 50 == 0) retrograde_memoization_evict(static_cast<uint64_t>(i % 30));
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_LE(retrograde_memoization_bytes(), 3000);
}

// ---- errors ----

TEST_F(Memoize, AnImageWithoutATagIsAnError) {
  Var x("x");
  ImageParam in(Int(32), 1, "photo");
  Func f("f"), out("out");
  f(x) = in(x);
  out(x) = f(x);
  memoize(f);
  const std::string message = error_of([&] { out.compile_jit(); });
  expect_mentions(message, {"\"photo\"", "memoize_tag"});
}

TEST_F(Memoize, ATagOfVarsIsAnError) {
  Var x("x");
  Func f("f"), out("out");
  f(x) = memoize_tag(x * 2, x);
  out(x) = f(x);
  memoize(f);
  expect_error({"the key of memoize_tag must be made of Params"}, [&] { out.compile_jit(); });
}

TEST_F(Memoize, AnOutputCannotBeMemoized) {
  Var x("x");
  Func f("f");
  f(x) = x;
  memoize(f);
  expect_error({"an output is computed by every call"}, [&] { f.compile_jit(); });
}

// The entry must not be found for another region that needs the same storage.
TEST_F(Memoize, StorageLargerThanWhatIsComputed) {
  for (const int how : {0, 1, 2}) {
    Var x("x");
    Func f("f"), g("g");
    f(x) = counted(x * 2);
    const int before = memoize_calls;
    g(x) = f(x) + 1;
    f.compute_root().memoize();
    if (how == 0) f.align_storage(x, 16);
    if (how == 1) f.bound_storage(x, 64);
    if (how == 2) f.align_storage(x, 16).bound_storage(x, 61);
    for (const int width : {10, 13, 10, 9}) {
      Buffer<int> result = g.realize({width});
      for (int i = 0; i < width; i++) ASSERT_EQ(result(i), 2 * i + 1) << how << " " << i;
    }
    EXPECT_EQ(memoize_calls - before, 10 + 13 + 9) << how;
  }
}

// Points that RoundUp computes beyond the required region are not values of the Func: its producer
// is not computed there.
TEST_F(Memoize, StorageThatASplitRoundsUp) {
  Var x("x"), xo("xo"), xi("xi");
  Func source("source"), f("f"), g("g");
  source(x) = x * 3;
  f(x) = counted(source(x));
  const int before = memoize_calls;
  g(x) = f(x) + 1;
  source.compute_root();
  f.compute_root().split(x, xo, xi, 16, TailStrategy::RoundUp).memoize();
  for (const int width : {3, 13, 16, 3}) {
    Buffer<int> result = g.realize({width});
    for (int i = 0; i < width; i++) ASSERT_EQ(result(i), 3 * i + 1) << width << " " << i;
  }
  EXPECT_EQ(memoize_calls - before, 3 * 16);
}

TEST_F(Memoize, BoundsThatAreAligned) {
  for (const bool extent_only : {false, true}) {
    Var x("x");
    Func f("f"), g("g");
    f(x) = counted(x * 2);
    g(x) = f(x) + 1;
    f.compute_root().memoize();
    extent_only ? f.align_extent(x, 8) : f.align_bounds(x, 8, 3);
    const int before = memoize_calls;
    for (const int width : {9, 11, 17, 11}) {
      Buffer<int> result = g.realize({width});
      for (int i = 0; i < width; i++) ASSERT_EQ(result(i), 2 * i + 1) << extent_only << " " << i;
    }
    // 9 and 11 elements lie in one aligned region.
    EXPECT_EQ(memoize_calls - before, 16 + 24) << extent_only;
  }
}

TEST_F(Memoize, StorageThatIsHoisted) {
  for (const bool rules : {false, true}) {
    Var x("x"), y("y"), xo("xo"), yo("yo"), xi("xi"), yi("yi");
    Func f("f"), g("g");
    f(x, y) = Tuple(counted(x * 3 + y), cast<float>(x));
    g(x, y) = f(x - 1, y)[0] + cast<int>(f(x, y + 1)[1]);
    g.tile(x, y, xo, yo, xi, yi, 8, 4);
    f.compute_at(g, xo).hoist_storage_root().memoize();
    if (rules) f.align_storage(x, 16).bound_storage(y, 7);
    const int before = memoize_calls;
    int after_first = 0;
    for (int round = 0; round < 2; round++) {
      Buffer<int> result = g.realize({21, 18});
      result.for_each_element(
          [&](int i, int j) { ASSERT_EQ(result(i, j), (i - 1) * 3 + j + i) << i << " " << j; });
      if (round == 0) after_first = memoize_calls;
    }
    EXPECT_GT(after_first, before);
    EXPECT_EQ(memoize_calls, after_first);
  }
}

TEST_F(Memoize, StorageThatWrapsAround) {
  Var x("x");
  Func f("f"), g("g");
  f(x) = counted(x * 2);
  g(x) = f(x) + f(x + 1);
  f.compute_root().memoize().fold_storage(x, 32);
  for (int round = 0; round < 2; round++) {
    for (const int min : {0, 13, 40}) {
      Buffer<int> result(std::vector<int>{20});
      result.set_min({min});
      g.realize(result);
      for (int i = min; i < min + 20; i++) ASSERT_EQ(result(i), 4 * i + 2);
    }
  }
  EXPECT_EQ(memoize_calls, 3 * 21);
}

}  // namespace
}  // namespace retrograde
