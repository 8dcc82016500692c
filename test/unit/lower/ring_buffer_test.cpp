// ring_buffer(n): copies of hoisted storage that iterations use in turn.
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

#include "ir/build.h"
#include "ir/visit.h"
#include "lower/lower.h"
#include "retrograde/retrograde.h"
#include "support/errors.h"
#include "support/variables.h"

namespace retrograde {
namespace {

constexpr int width = 37, height = 22;
const Var xo("xo"), yo("yo"), xi("xi"), yi("yi");

void expect_values(Func f, const std::function<int(int, int)>& value) {
  const Buffer<int> found = f.realize({width, height});
  for (int j = 0; j < height; ++j) {
    for (int i = 0; i < width; ++i) ASSERT_EQ(found(i, j), value(i, j)) << i << " " << j;
  }
}

// The number of elements allocated outside of all loops.
int64_t elements_outside(const Func& output) {
  lower::LowerOptions options;
  options.stop_after = "simplify_storage";
  const ir::LoweredFunction lowered = lower::lower(
      "test", {output.function()}, lower::infer_arguments({output.function()}), options);
  int64_t result = 0;
  std::function<void(const Stmt&)> visit = [&](const Stmt& s) {
    if (s.as<ir::For>()) return;
    if (const auto* n = s.as<ir::Allocate>())
      if (n->name.rfind("f", 0) == 0) result += ir::as_const_int(n->elements).value_or(-1);
    ir::for_each_child(
        s, [](const Expr&) {}, [&](const Stmt& child) { visit(child); });
  };
  visit(lowered.body);
  return result;
}

// g in tiles of 8 by 4, with f computed for each tile.
struct Tiles {
  Func f{"f"}, g{"g"};
  Tiles() {
    f(x, y) = x * 3 + y;
    g(x, y) = f(x - 1, y) + f(x, y + 1);
    g.tile(x, y, xo, yo, xi, yi, 8, 4);
    f.compute_at(g, xo);
  }
  void expect() const {
    expect_values(g, [](int i, int j) { return (i - 1) * 3 + j + i * 3 + j + 1; });
  }
};

TEST(RingBuffer, HasRoomForEachCopy) {
  for (int copies = 1; copies < 5; ++copies) {
    Tiles t;
    t.f.hoist_storage_root().ring_buffer(copies);
    EXPECT_EQ(elements_outside(t.g), copies * 9 * 5);
    t.expect();
  }
}

TEST(RingBuffer, IsUsedAheadByAsyncFuncs) {
  for (int copies = 1; copies < 6; ++copies) {
    for (int level = 0; level < 2; ++level) {
      Tiles t;
      if (level == 0) t.f.hoist_storage_root();
      if (level == 1) t.f.hoist_storage(t.g, yo);
      t.f.ring_buffer(copies).async();
      t.expect();
    }
  }
}

TEST(RingBuffer, OfSeveralCopiesByAParameter) {
  Param<int> copies("copies");
  Tiles t;
  t.f.hoist_storage(t.g, yo).ring_buffer(copies);
  for (int n : {1, 3, 7}) {
    copies.set(n);
    t.expect();
  }
  copies.set(0);
  expect_error<RuntimeError>({"ring buffer", "the number of copies is at least 1"},
                             [&] { t.expect(); });
}

TEST(RingBuffer, OfTuplesAndOtherOrdersOfStorage) {
  for (bool runs_ahead : {false, true}) {
    Func f("f"), g("g");
    f(x, y) = Tuple(x * 3 + y, cast<float>(x));
    g(x, y) = f(x - 1, y)[0] + cast<int>(f(x, y + 1)[1]);
    g.tile(x, y, xo, yo, xi, yi, 8, 4);
    f.compute_at(g, xo).hoist_storage_root().reorder_storage(y, x).ring_buffer(3);
    if (runs_ahead) f.async();
    expect_values(g, [](int i, int j) { return (i - 1) * 3 + j + i; });
  }
}

TEST(RingBuffer, OfWindowsThatSlide) {
  Func f("f"), g("g");
  f(x, y) = x * 3 + y;
  g(x, y) = f(x - 1, y) + f(x + 1, y);
  f.compute_at(g, x).store_at(g, y).hoist_storage_root().ring_buffer(2);
  EXPECT_EQ(elements_outside(g), 2 * 4);
  expect_values(g, [](int i, int j) { return 6 * i + 2 * j; });
}

TEST(RingBuffer, OfUpdates) {
  for (bool runs_ahead : {false, true}) {
    Func f("f"), g("g");
    const RDom r(0, 3);
    f(x, y) = x;
    f(x, y) += r * y;
    g(x, y) = f(x, y) + f(x, y + 1);
    f.compute_at(g, y).hoist_storage_root().ring_buffer(2);
    if (runs_ahead) f.async();
    expect_values(g, [](int i, int j) { return 2 * i + 3 * j + 3 * (j + 1); });
  }
}

// a and b run ahead, b reads a; the output or another Func reads it too.
TEST(RingBuffer, OfAsyncFuncsThatReadEachOther) {
  for (int variant = 0; variant < 12; ++variant) {
    SCOPED_TRACE(variant);
    const bool both_read = variant % 2, b_is_at_root = variant / 2 % 2;
    const int copies = 1 + variant / 4;
    Func a("a"), b("b"), c("c"), g("g");
    a(x, y) = x + 2 * y;
    b(x, y) = a(x, y) * 3 + x;
    c(x, y) = b(x, y) + (both_read ? a(x + 1, y) : Expr(0));
    g(x, y) = c(x, y) + c(x, y + 1);
    g.tile(x, y, xo, yo, xi, yi, 8, 4);
    a.compute_at(g, xo).hoist_storage(g, yo).ring_buffer(copies).async();
    b.compute_at(g, xo).ring_buffer(2).async();
    b_is_at_root ? b.hoist_storage_root() : b.hoist_storage(g, yo);
    c.compute_at(g, xo);
    if (variant >= 8) c.hoist_storage(g, yo).ring_buffer(3);
    const auto value = [&](int i, int j) {
      return (i + 2 * j) * 3 + i + (both_read ? i + 1 + 2 * j : 0);
    };
    expect_values(g, [&](int i, int j) { return value(i, j) + value(i, j + 1); });
  }
}

TEST(RingBuffer, BesideAsyncFuncsWithoutOne) {
  for (bool ring_first : {false, true}) {
    Func a("a"), b("b"), g("g");
    a(x, y) = x + 2 * y;
    b(x, y) = a(x, y) * 3 + x;
    g(x, y) = a(x, y + 1) + b(x, y);
    g.tile(x, y, xo, yo, xi, yi, 8, 4);
    a.compute_at(g, xo).async();
    b.compute_at(g, xo).async();
    (ring_first ? a : b).hoist_storage(g, yo).ring_buffer(2);
    expect_values(g, [](int i, int j) { return i + 2 * (j + 1) + (i + 2 * j) * 3 + i; });
  }
}

TEST(RingBuffer, IsOfHoistedStorageOverSerialLoops) {
  Tiles not_hoisted, parallel, output, inlined, memoized;
  not_hoisted.f.ring_buffer(2);
  expect_error(
      {"a ring buffer lies in storage that is hoisted over serial loops", "hoist_storage()"},
      [&] { not_hoisted.expect(); });
  parallel.g.parallel(xo);
  parallel.f.hoist_storage(parallel.g, yo).ring_buffer(2);
  EXPECT_THROW(parallel.expect(), UserError);
  output.g.ring_buffer(2);
  expect_error({"it is an output"}, [&] { output.expect(); });
  memoized.f.hoist_storage_root().ring_buffer(2).memoize();
  expect_error({"memoize"}, [&] { memoized.expect(); });
  inlined.f.compute_inline().ring_buffer(2);
  expect_error({"ring buffer", "inlined"}, [&] { inlined.expect(); });
}

TEST(RingBuffer, NumbersOfCopiesAreChecked) {
  Tiles t;
  t.f.hoist_storage_root();
  expect_error({"the number of copies must be a defined expression"},
               [&] { t.f.ring_buffer(Expr()); });
  expect_error({"the number of copies is an integer"}, [&] { t.f.ring_buffer(1.5f); });
  expect_error({"the number of copies is at least 1 and fits an int32"},
               [&] { t.f.ring_buffer(0); });
  expect_error({"the number of copies has one value in each call"},
               [&] { t.f.ring_buffer(Expr(x)); });
  Param<int> n("n");
  t.f.ring_buffer(n).async();
  expect_error({"an async Func has a constant number of copies"}, [&] { t.expect(); });
}

TEST(RingBuffer, OfAsyncFuncsIsUsedAsAWhole) {
  Func f("f"), g("g");
  f(x, y) = x * 3 + y;
  g(x, y) = f(x - 1, y) + f(x + 1, y);
  f.compute_at(g, x).store_at(g, y).hoist_storage_root().ring_buffer(2).async();
  expect_error<Unsupported>({"is computed where it is stored", "in loops of fixed extent"}, [&] {
    g.realize({4, 4});
  });
}

// Each y needs more of g, so the number of its tiles depends on y; f is computed for each tile.
TEST(RingBuffer, OfAsyncFuncsTakesTurnsInLoopsOfFixedExtent) {
  for (bool runs_ahead : {false, true}) {
    Func f("f"), g("g"), h("h");
    const RDom r(0, 12);
    f(x) = x * 3;
    g(x) = f(x) + 1;
    h(y) = 0;
    h(y) += g(clamp(r, 0, y));
    g.compute_at(h, y).split(x, xo, xi, 2, TailStrategy::RoundUp);
    f.compute_at(g, xo).hoist_storage_root().ring_buffer(3);
    if (runs_ahead) {
      f.async();
      expect_error<Unsupported>({"in loops of fixed extent", "varies"}, [&] { h.realize({9}); });
      continue;
    }
    const Buffer<int> found = h.realize({9});
    for (int j = 0; j < 9; ++j) {
      int sum = 0;
      for (int k = 0; k < 12; ++k) sum += 3 * std::min(k, j) + 1;
      EXPECT_EQ(found(j), sum) << j;
    }
  }
}

}  // namespace
}  // namespace retrograde
