// hoist_storage: memory is allocated once, in an outer loop, at its maximum size.
#include <gtest/gtest.h>

#include "ir/build.h"
#include "ir/visit.h"
#include "lower/lower.h"
#include "retrograde/retrograde.h"

namespace retrograde {
namespace {

class HoistStorage : public testing::Test {
 protected:
  Var x{"x"}, y{"y"}, xo{"xo"}, yo{"yo"}, xi{"xi"}, yi{"yi"};
  static constexpr int width = 21, height = 18;

  static void expect_values(Func f, int (*value)(int, int)) {
    Buffer<int> found = f.realize({width, height});
    found.for_each_element(
        [&](int i, int j) { ASSERT_EQ(found(i, j), value(i, j)) << i << " " << j; });
  }

  // The number of loops around the only allocation, and its elements when constant.
  static std::pair<int, int64_t> allocation(const Func& output) {
    std::pair<int, int64_t> result{-1, -1};
    lower::LowerOptions options;
    options.stop_after = "simplify_storage";
    ir::LoweredFunction lowered = lower::lower(
        "test", {output.function()}, lower::infer_arguments({output.function()}), options);
    std::function<void(const Stmt&, int)> visit = [&](const Stmt& s, int loops) {
      if (const ir::Allocate* n = s.as<ir::Allocate>())
        result = {loops, ir::as_const_int(n->elements).value_or(-1)};
      ir::for_each_child(
          s, [](const Expr&) {},
          [&](const Stmt& child) { visit(child, loops + (s.as<ir::For>() ? 1 : 0)); });
    };
    visit(lowered.body, 0);
    return result;
  }
};

TEST_F(HoistStorage, OutOfTheLoopsOverTiles) {
  Func f("f"), g("g");
  f(x, y) = x * 3 + y;
  g(x, y) = f(x - 1, y) + f(x, y + 1);
  g.tile(x, y, xo, yo, xi, yi, 8, 4);
  f.compute_at(g, xo).hoist_storage_root();
  EXPECT_EQ(allocation(g), std::make_pair(0, int64_t{9 * 5}));
  expect_values(g, [](int i, int j) { return (i - 1) * 3 + j + i * 3 + j + 1; });
}

TEST_F(HoistStorage, ToALoopInside) {
  Func f("f"), g("g");
  f(x, y) = x * 3 + y;
  g(x, y) = f(x - 1, y) + f(x, y + 1);
  g.tile(x, y, xo, yo, xi, yi, 8, 4).parallel(yo);
  f.compute_at(g, yi).store_at(g, xo).hoist_storage(g, yo);
  EXPECT_EQ(allocation(g), std::make_pair(1, int64_t{9 * 2})) << "two rows are alive";
  expect_values(g, [](int i, int j) { return (i - 1) * 3 + j + i * 3 + j + 1; });
}

TEST_F(HoistStorage, OfWindowsThatSlide) {
  Func f("f"), g("g");
  f(x, y) = x * 3 + y;
  g(x, y) = f(x - 1, y) + f(x + 1, y);
  f.compute_at(g, x).store_at(g, y).hoist_storage_root();
  EXPECT_EQ(allocation(g), std::make_pair(0, int64_t{4}));
  expect_values(g, [](int i, int j) { return 6 * i + 2 * j; });
}

TEST_F(HoistStorage, OfTuples) {
  Func f("f"), g("g");
  f(x, y) = Tuple(x * 3 + y, cast<float>(x));
  g(x, y) = f(x - 1, y)[0] + cast<int>(f(x, y + 1)[1]);
  g.tile(x, y, xo, yo, xi, yi, 8, 4);
  f.compute_at(g, xo).hoist_storage_root();
  expect_values(g, [](int i, int j) { return (i - 1) * 3 + j + i; });
}

TEST_F(HoistStorage, NotOutOfAParallelLoop) {
  Func f("f"), g("g");
  f(x, y) = x * 3 + y;
  g(x, y) = f(x - 1, y) + f(x, y + 1);
  g.parallel(y);
  f.compute_at(g, y).hoist_storage_root();
  EXPECT_THROW(g.realize({4, 4}), UserError);
}

}  // namespace
}  // namespace retrograde
