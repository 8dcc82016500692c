// Funcs as coordinates of other Funcs: the range of their values bounds the region that is read.
#include <gtest/gtest.h>

#include "lower/definitions/inline_functions.h"
#include "lower/definitions/value_bounds.h"
#include "retrograde/retrograde.h"
#include "support/variables.h"

namespace retrograde {
namespace {

ir::Interval bounds_of_func(const Func& f) {
  analysis::ValueBounds bounds = lower::value_bounds(lower::inline_functions({f.function()}));
  return bounds[{f.name(), 0}];
}

TEST(ValueBounds, FollowClamps) {
  Func f("f");
  f(x) = clamp(x * x, 2, 9);
  ir::Interval bounds = bounds_of_func(f);
  ASSERT_TRUE(bounds.is_bounded());
  EXPECT_EQ(ir::as_const_int(bounds.min), 2);
  EXPECT_EQ(ir::as_const_int(bounds.max), 9);
}

TEST(ValueBounds, ContainUpdatesAndForgetCoordinates) {
  Func f("f"), g("g");
  f(x) = clamp(x, 0, 3);
  f(0) = 7;
  EXPECT_EQ(ir::as_const_int(bounds_of_func(f).max), 7);
  g(x) = x + 1;
  EXPECT_FALSE(bounds_of_func(g).has_lower_bound());
}

TEST(ValueBounds, BoundWhatIsReadAtAComputedIndex) {
  Func table("table"), index("index"), out("out");
  table(x) = x * 10;
  index(x) = clamp(x * 3 - 2, 0, 5);
  out(x) = table(index(x) + 1);
  table.compute_root();
  index.compute_root();
  Buffer<int> result = out.realize({4});
  const int expected[] = {10, 20, 50, 60};
  for (int i = 0; i < 4; i++) EXPECT_EQ(result(i), expected[i]);
}

}  // namespace
}  // namespace retrograde
