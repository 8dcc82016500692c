// A clamped index is read densely away from its limits, like a boundary condition, and gives the
// same values wherever the limits lie. Oracles: repeat_edge, and plain loops.
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <vector>

#include "ir/atomic_update.h"
#include "ir/visit.h"
#include "lower/lower.h"
#include "retrograde/retrograde.h"
#include "support/variables.h"

namespace retrograde {
namespace {

// Vector loads of "in" in the code for f, with consecutive and with other indices.
struct Loads {
  int dense = 0, gathered = 0;
};
Loads vector_loads(const Func& f) {
  lower::LowerOptions options;
  options.validate = true;
  const std::vector<graph::FuncPtr> outputs = {f.function()};
  const ir::LoweredFunction code =
      lower::lower("f", outputs, lower::infer_arguments(outputs), options);
  Loads loads;
  ir::walk(code.body, [&](const ir::Load& load) {
    if (load.name == "in" && load.index.type().is_vector())
      ++(load.index.kind() == ir::Kind::Ramp ? loads.dense : loads.gathered);
  });
  return loads;
}

// Three taps of `source`, eight at a time.
Func taps(const std::function<Expr(const Expr&)>& source) {
  Func f("taps");
  f(x) = source(x - 1) + 2 * source(x) + source(x + 1);
  f.vectorize(x, 8);
  return f;
}

TEST(LikelyClamps, AClampIsReadAsABoundaryConditionIs) {
  ImageParam in(Int(32), 1, "in");
  const Expr last = in.dim(0).extent() - 1;
  const Func edge = BoundaryConditions::repeat_edge(in, {{0, in.dim(0).extent()}});
  const Loads condition = vector_loads(taps([&](const Expr& at) { return edge(at); }));
  ASSERT_GE(condition.dense, 3);
  for (const auto& clamped : {taps([&](const Expr& at) { return in(clamp(at, 0, last)); }),
                              taps([&](const Expr& at) { return in(max(min(last, at), 0)); }),
                              taps([&](const Expr& at) { return in(min(max(0, at), last)); })}) {
    const Loads loads = vector_loads(clamped);
    EXPECT_EQ(loads.dense, condition.dense);
    EXPECT_EQ(loads.gathered, condition.gathered);
  }
}

TEST(LikelyClamps, ThroughAFuncThatIsInlined) {
  ImageParam in(Int(32), 1, "in");
  Func clamped("clamped");
  clamped(x) = in(clamp(x, 0, in.dim(0).extent() - 1));
  EXPECT_GE(vector_loads(taps([&](const Expr& at) { return clamped(at); })).dense, 3);
}

TEST(LikelyClamps, NotWhereDataOrMovingLimitsDecide) {
  ImageParam in(Int(32), 1, "in"), at(Int(32), 1, "at");
  Func by_data("by_data"), moving("moving");
  by_data(x) = in(clamp(at(x), 0, 9));
  moving(x, y) = in(clamp(x, y - 5, y + 5));
  // A loop that may not run past its end would be partitioned for that.
  by_data.vectorize(x, 8, TailStrategy::RoundUp), moving.vectorize(x, 8, TailStrategy::RoundUp);
  EXPECT_EQ(vector_loads(by_data).dense, 0);
  EXPECT_EQ(vector_loads(moving).dense, 0);
}

// Reads inside an update's own index stay in the index of the store. Otherwise an atomic update
// would read the element outside of the atomic exchange, and lose concurrent sums.
TEST(LikelyClamps, NotInTheIndicesByWhichAnUpdateAccumulates) {
  ImageParam in(Int(32), 1, "in");
  constexpr int samples = 100000;
  const RDom r(0, samples);
  const Expr bin = in(clamp(r, 0, in.dim(0).extent() - 1));
  Func sums("sums");
  sums(x) = 0;
  sums(clamp(bin, 0, 4)) += bin;
  sums.update().atomic().parallel(r);
  int updates = 0, others = 0;  // in each part of the loop
  const std::vector<graph::FuncPtr> outputs = {sums.function()};
  const ir::LoweredFunction code =
      lower::lower("sums", outputs, lower::infer_arguments(outputs), lower::LowerOptions());
  ir::walk(code.body, [&](const ir::Atomic& atomic) {
    const auto* store = atomic.body.as<ir::Store>();
    ++(store && ir::find_atomic_update(*store) ? updates : others);
  });
  EXPECT_GT(updates, 0);
  EXPECT_EQ(others, 0);
  Buffer<int> data(samples);
  data.for_each_element([&](int i) { data(i) = i % 5; });
  in.set(data);
  const Buffer<int> found = sums.realize({5});
  for (int i = 0; i < 5; i++) EXPECT_EQ(found(i), i * (samples / 5));
}

TEST(LikelyClamps, EverySizeAndLimitGivesThePlainLoopsValues) {
  ImageParam in(Int(32), 2, "in");
  Param<int> low("low"), high("high");
  RDom r(-2, 5, -2, 5);
  Func f("f");
  f(x, y) = sum(in(clamp(x + r.x, low, high), clamp(y + 2 * r.y, 0, in.dim(1).extent() - 1)) *
                (r.x + 3 * r.y));
  f.vectorize(x, 8, TailStrategy::GuardWithIf);
  for (const int width : {1, 3, 8, 29}) {
    for (const int height : {1, 4}) {
      Buffer<int> image(width, height);
      image.for_each_element([&](int i, int j) { image(i, j) = i * i + 37 * j; });
      in.set(image);
      for (const auto& [least, most] : {std::pair(0, width - 1), {width / 2, width / 2}}) {
        low.set(least), high.set(most);
        const Buffer<int> result = f.realize({width + 3, height + 1});
        for (int j = 0; j <= height; ++j) {
          for (int i = 0; i < width + 3; ++i) {
            int expected = 0;
            for (int v = -2; v <= 2; ++v) {
              for (int u = -2; u <= 2; ++u) {
                const int at = std::max(std::min(i + u, most), least);
                expected += image(at, std::clamp(j + 2 * v, 0, height - 1)) * (u + 3 * v);
              }
            }
            ASSERT_EQ(result(i, j), expected)
                << i << ", " << j << " of " << width << " x " << height;
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace retrograde
