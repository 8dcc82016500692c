// Coordinates computed from floats: the region that is computed or required must be the one that is
// read, even if the processor fuses products and sums.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "retrograde/retrograde.h"
#include "support/variables.h"

namespace retrograde {
namespace {

// Rounds each operation: volatile keeps the host compiler from fusing them.
int strict_place(int at, float scale) {
  volatile float moved = static_cast<float>(at) + 0.5f;
  volatile float scaled = moved * scale;
  volatile float back = scaled - 0.5f;
  return static_cast<int>(std::floor(back));
}

Expr position(const Expr& scale) { return (cast<float>(x) + 0.5f) * scale - 0.5f; }

// Scales that put a coordinate just below a power of two, where a fused product and sum round to
// another integer; and some others.
std::vector<float> hard_scales() {
  std::vector<float> scales{0.3f, -0.3f, 1.0f / 3, -2.0f / 7, 1.9f};
  for (int power = 1; power <= 32; power *= 2) {
    for (int at = 0; at < 40; ++at) {
      const float from = static_cast<float>(at) + 0.5f;
      float k = (static_cast<float>(power) + 0.5f) / from;
      for (int step = 0; step < 3; ++step, k = std::nextafter(k, 0.0f)) {
        if (static_cast<int>(std::floor(std::fma(from, k, -0.5f))) != strict_place(at, k))
          scales.push_back(k);
      }
    }
  }
  return scales;
}

// `f` returns the coordinate that it read, and its input is as large as the required region.
void expect_strict_places(Func f, ImageParam in, Param<float> scale) {
  f.vectorize(x, 8, TailStrategy::GuardWithIf);
  const std::vector<float> scales = hard_scales();
  ASSERT_GT(scales.size(), 20u);
  for (const float k : scales) {
    const int n = 40;
    scale.set(k);
    in.reset();
    f.infer_input_bounds({n});
    Buffer<int> places = in.get();
    places.for_each_element([&](int at) { places(at) = at; });
    const Buffer<int> read = f.realize({n});
    int least = strict_place(0, k), most = least;
    for (int i = 0; i < n; ++i) {
      const int at = strict_place(i, k);
      ASSERT_EQ(read(i), at) << "scale " << k << ", at " << i;
      least = std::min(least, at), most = std::max(most, at);
    }
    EXPECT_EQ(places.dim(0).min(), least) << "scale " << k;
    EXPECT_EQ(places.dim(0).max(), most) << "scale " << k;
  }
}

TEST(FloatIndex, TheRegionAskedForIsTheOneRead) {
  ImageParam in(Int(32), 1, "in");
  Param<float> scale("scale");
  Func f("f");
  f(x) = in(cast<int>(floor(position(scale))));
  expect_strict_places(f, in, scale);
}

// The fraction of the position, which is computed outside of the index too, is less than 1.
TEST(FloatIndex, AlsoWhenThePlaceSharesItsPositionWithAWeight) {
  ImageParam in(Int(32), 1, "in");
  Param<float> scale("scale");
  Func f("f");
  const Expr at = position(scale);
  f(x) = in(cast<int>(floor(at))) + cast<int>((at - floor(at)) * 0.99f);
  expect_strict_places(f, in, scale);
}

// The element read at floor(at), less floor(at) in a value: of the same stage, and of a Func with loops of its own and
// other variables, whose operands are in another order.
TEST(FloatIndex, APlaceIsTheSameNumberWhereItIsAValue) {
  const int n = 40;
  Param<float> scale("scale");
  for (const int lanes : {1, 4, 8}) {
    Func g("g"), same("same"), apart("apart"), floors("floors"), fraction("fraction");
    g(x) = x;
    const Expr of_x = position(scale);
    const Expr of_y = scale * (0.5f + cast<float>(min(y, 1000))) - 0.5f;
    const Expr read = cast<float>(g(cast<int>(floor(of_x))));
    floors(y) = floor(of_y);
    fraction(y) = of_y - floor(of_y);
    same(x) = read - floor(of_x);
    apart(x) = read - floors(x) + select(fraction(x) < 0, 1, 0);
    g.compute_root();
    floors.compute_root();
    fraction.compute_root();
    if (lanes > 1) {
      for (const Func& f : {same, apart}) Func(f).vectorize(x, lanes, TailStrategy::GuardWithIf);
    }
    for (const float k : hard_scales()) {
      scale.set(k);
      const Buffer<float> in_stage = same.realize({n}), in_others = apart.realize({n});
      for (int at = 0; at < n; ++at) {
        ASSERT_EQ(in_stage(at), 0) << "scale " << k << ", at " << at << ", lanes " << lanes;
        ASSERT_EQ(in_others(at), 0) << "scale " << k << ", at " << at << ", lanes " << lanes;
      }
    }
  }
}

TEST(FloatIndex, LinearInterpolationOfAStoredFunc) {
  for (const float scale : {0.3f, 1.0f / 3, 0.7f, 1.9f, -0.6f}) {
    Func g("g"), f("f");
    g(x) = cast<float>(x);
    const Expr at = position(scale);
    const Expr i = cast<int>(floor(at));
    f(x) = lerp(g(i), g(i + 1), at - floor(at));
    g.compute_root();
    Var xo("xo"), xi("xi");
    f.split(x, xo, xi, 16).vectorize(xi, 8).parallel(xo);
    const Buffer<float> result = f.realize({64});
    for (int i0 = 0; i0 < 64; ++i0) {
      const float expected = (static_cast<float>(i0) + 0.5f) * scale - 0.5f;
      EXPECT_NEAR(result(i0), expected, 1e-4f) << scale;
    }
  }
}

TEST(FloatIndex, QuotientsAndConstantsBoundWhatIsComputedInATile) {
  Func g("g"), f("f");
  g(x, y) = x + 100 * y;
  f(x, y) = g(cast<int>(cast<float>(x) / 3.0f), cast<int>(ceil(cast<float>(y) * -0.25f)));
  Var xi("xi"), yi("yi");
  f.tile(x, y, xi, yi, 8, 4);
  g.compute_at(f, x);
  const Buffer<int> result = f.realize({24, 12});
  for (int j = 0; j < 12; ++j) {
    for (int i = 0; i < 24; ++i) {
      ASSERT_EQ(result(i, j), static_cast<int>(static_cast<float>(i) / 3.0f) - 100 * (j / 4));
    }
  }
}

// In an update definition: the histogram of a slice by position.
TEST(FloatIndex, WhereAnUpdateStores) {
  Func h("h"), f("f");
  RDom r(0, 30);
  h(x) = 0;
  h(cast<int>(floor(cast<float>(r) * 0.19f))) += 1;
  f(x) = h(x);
  h.compute_root();
  const Buffer<int> result = f.realize({6});
  int all = 0;
  for (int i = 0; i < 6; ++i) all += result(i);
  EXPECT_EQ(all, 30);
}

}  // namespace
}  // namespace retrograde
