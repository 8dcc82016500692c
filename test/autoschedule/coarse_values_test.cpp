// Tests which values of coarse grids become Funcs of their own, and that values, bounds and the user's Funcs stay as
// they are.
#include "transform/coarse_values.h"

#include <gtest/gtest.h>

#include <retrograde/retrograde.h>

#include <string>
#include <vector>

#include "graph/function.h"
#include "graph/names.h"
#include "support/variables.h"
#include "testing/interpreter.h"
#include "transform/invariant_factors.h"

namespace retrograde::transform {
namespace {

constexpr int cell = 16, knots = 6, size = 64;

Buffer<float> grid_of(const std::vector<int>& sizes) {
  Buffer<float> result(sizes);
  int i = 0;
  result.get()->for_each_value([&](float& v) { v = static_cast<float>(i++ * 7 % 23) * 0.125f; });
  return result;
}

Expr fraction(const Expr& at, int step = cell) { return cast<float>(at % step) * (1.0f / step); }

// A value with two dimensions for whose stages sizes are known.
Func whole(const Func& f, int width = size, int height = size) {
  Func total("total");
  RDom s(0, width, 0, height, "s");
  total() = 0.0f;
  total() += f(s.x, s.y) * f(s.x, s.y);
  return total;
}

struct Surface {
  Buffer<float> grid = grid_of({knots, knots});
  Func surface{"surface"};
  Expr row(const Expr& across, const Expr& j) {
    return grid(x / cell, j) * (1.0f - across) + grid(x / cell + 1, j) * across;
  }
  // The rows first, then between them.
  Func nested() {
    surface(x, y) = row(fraction(x), y / cell) * (1.0f - fraction(y)) +
                    row(fraction(x), y / cell + 1) * fraction(y);
    return whole(surface);
  }
  Func written_out() {
    const Expr a = fraction(x), b = fraction(y);
    surface(x, y) = cast<float>(x) + (1.0f - a) * (1.0f - b) * grid(x / cell, y / cell) -
                    a * (b - 1.0f) * grid(x / cell + 1, y / cell) +
                    b * grid(x / cell, y / cell + 1) * (1.0f - a) +
                    b * grid(x / cell + 1, y / cell + 1) * a;
    return whole(surface);
  }
  Func as_sum() {
    Func hat("hat");
    Var k("k");
    RDom r(0, 2, 0, 2, "r");
    hat(x, k) = select(k == 0, 1.0f - fraction(x), fraction(x));
    surface(x, y) = 0.0f;
    surface(x, y) += hat(x, r.x) * hat(y, r.y) * grid(x / cell + r.x, y / cell + r.y);
    return whole(surface);
  }
};

std::vector<FuncPtr> rows_in(const FuncPtr& output) {
  return filtered(topological_order({output}),
                  [](const FuncPtr& f) { return f->made.has_value(); });
}
std::vector<FuncPtr> rows_of(const Func& output, SumOrder order = SumOrder::Kept) {
  return rows_in(with_invariant_factors({output.function()}, order).front());
}
double value_of(const FuncPtr& f) {
  return oracle::Interpreter().realize(f, {}).front().values[0].scalar.as_double();
}
size_t reads_in(const FuncContents& f, const std::string& name) {
  size_t reads = 0;
  walk(f, [&](const Call& call) { reads += call.name == name; });
  return reads;
}

TEST(CoarseValues, AreRowsOfTheGrid) {
  Surface s;
  const FuncPtr output = s.nested().function();
  const std::vector<FuncPtr> outputs = with_invariant_factors({output});
  const std::vector<FuncPtr> rows = rows_in(outputs[0]);
  ASSERT_EQ(rows.size(), 1u) << "both rows are elements of one Func";
  EXPECT_EQ(rows[0]->args, (std::vector<std::string>{"x", "y"}));
  EXPECT_EQ(reads_in(*rows[0], s.grid.name()), 2u);
  for (const FuncPtr& f : topological_order(outputs)) {
    if (!f->made) {
      EXPECT_EQ(reads_in(*f, s.grid.name()), 0u) << f->name;
    }
  }
  EXPECT_EQ(reads_in(*s.surface.function(), s.grid.name()), 4u) << "the user's Func stays";
  EXPECT_EQ(value_of(outputs[0]), value_of(output)) << "values keep their bits";
}

// Coordinates that are rounded give rows, too.
TEST(CoarseValues, OfGridsAtRegularPositions) {
  Surface s;
  const auto at = [](const Expr& v) { return cast<float>(v) * 0.07f; };
  const auto whole_part = [&](const Expr& v) { return cast<int>(floor(at(v))); };
  const Expr across = at(x) - floor(at(x)), down = at(y) - floor(at(y));
  const auto row = [&](const Expr& j) {
    const Expr i = whole_part(x);
    return lerp(s.grid(clamp(i, 0, knots - 1), clamp(j, 0, knots - 1)),
                s.grid(clamp(i + 1, 0, knots - 1), clamp(j, 0, knots - 1)), across);
  };
  s.surface(x, y) = lerp(row(whole_part(y)), row(whole_part(y) + 1), down);
  const FuncPtr output = whole(s.surface).function();
  const FuncPtr factored = with_invariant_factors({output}).front();
  EXPECT_EQ(rows_in(factored).size(), 1u);
  EXPECT_EQ(value_of(factored), value_of(output));
}

TEST(CoarseValues, OfTermsWithCommonFactorsNeedAnotherOrder) {
  Surface kept, free;
  EXPECT_TRUE(rows_of(kept.written_out()).empty());
  const FuncPtr output = free.written_out().function();
  const FuncPtr factored = with_invariant_factors({output}, SumOrder::Free).front();
  const std::vector<FuncPtr> rows = rows_in(factored);
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_EQ(reads_in(*rows[0], free.grid.name()), 2u);
  EXPECT_NEAR(value_of(factored), value_of(output), 1e-6 * value_of(output));
}

TEST(CoarseValues, OfSumsNeedAnotherOrder) {
  Surface kept, free;
  EXPECT_TRUE(rows_of(kept.as_sum()).empty());
  const FuncPtr output = free.as_sum().function();
  const FuncPtr factored = with_invariant_factors({output}, SumOrder::Free).front();
  const std::vector<FuncPtr> rows = rows_in(factored);
  ASSERT_EQ(rows.size(), 1u);
  ASSERT_EQ(rows[0]->updates.size(), 1u);
  EXPECT_EQ(rows[0]->updates[0].rvars.size(), 1u);
  EXPECT_NEAR(value_of(factored), value_of(output), 1e-6 * value_of(output));
  Buffer<float> expected = Func(output).realize(), found = Func(factored).realize();
  EXPECT_NEAR(found(), expected(), 1e-5f * expected());
}

// Three dimensions take three steps.
TEST(CoarseValues, OfVolumesAreInterpolatedAlongEachDimension) {
  Func hat("hat"), field("field"), total("total");
  Var k("k");
  RDom r(0, 2, 0, 2, 0, 2, "r"), s(0, 32, 0, 32, 0, 32, "s");
  const Buffer<float> grid = grid_of({4, 4, 4});
  hat(x, k) = select(k == 0, 1.0f - fraction(x), fraction(x));
  field(x, y, z) = 0.0f;
  field(x, y, z) -= hat(x, r.x) * hat(y, r.y) * hat(z, r.z) *
                    grid(x / cell + r.x, y / cell + r.y, z / cell + r.z);
  total() = 0.0f;
  total() += field(s.x, s.y, s.z);
  const FuncPtr output = total.function();
  const FuncPtr factored = with_invariant_factors({output}, SumOrder::Free).front();
  const std::vector<FuncPtr> rows = rows_in(factored);
  ASSERT_EQ(rows.size(), 2u);
  for (const FuncPtr& f : rows) EXPECT_EQ(f->updates.at(0).rvars.size(), 1u);
  EXPECT_NEAR(value_of(factored), value_of(output), -1e-6 * value_of(output));
}

// ---- values that stay ----

TEST(CoarseValues, OfScheduledFuncsStay) {
  Surface s;
  const Func output = s.nested();
  s.surface.compute_root();
  EXPECT_TRUE(rows_of(output, SumOrder::Free).empty());
}

TEST(CoarseValues, OfGridsThatAreNotCoarseStay) {
  Surface s;
  const Buffer<float> grid = grid_of({34, 34});
  const auto row = [&](const Expr& j) {
    return lerp(grid(x / 2, j), grid(x / 2 + 1, j), fraction(x, 2));
  };
  s.surface(x, y) = lerp(row(y / 2), row(y / 2 + 1), fraction(y, 2));
  EXPECT_TRUE(rows_of(whole(s.surface), SumOrder::Free).empty());
}

TEST(CoarseValues, AtDataDependentIndicesStay) {
  Surface s;
  const Buffer<int> at(size, size);
  const Expr j = clamp(at(x, y), 0, knots - 2);
  s.surface(x, y) = lerp(s.row(fraction(x), j), s.row(fraction(x), j + 1), fraction(y));
  EXPECT_TRUE(rows_of(whole(s.surface), SumOrder::Free).empty());
}

TEST(CoarseValues, AlongOneDimensionStay) {
  Surface s;
  const Expr value = lerp(s.grid(x / cell, 0), s.grid(x / cell + 1, 0), fraction(x));
  s.surface(x, y) = value * cast<float>(y);
  EXPECT_TRUE(rows_of(whole(s.surface), SumOrder::Free).empty());
}

TEST(CoarseValues, OfUpdatesWithPredicatesStay) {
  Surface s;
  RDom r(0, 2, 0, 2, "r");
  r.where(r.x + r.y < 2);
  s.surface(x, y) = 0.0f;
  s.surface(x, y) += fraction(y + r.y) * fraction(x + r.x) * s.grid(x / cell + r.x, y / cell + r.y);
  EXPECT_TRUE(rows_of(whole(s.surface), SumOrder::Free).empty());
}

TEST(CoarseValues, WithEffectsStay) {
  Surface s;
  const auto row = [&](const Expr& j) { return retrograde::print(s.row(fraction(x), j)); };
  s.surface(x, y) = lerp(row(y / cell), row(y / cell + 1), fraction(y));
  for (const FuncPtr& f : rows_of(whole(s.surface)))
    EXPECT_FALSE(any_node(*f->pure, [](const Call& call) { return !call.is_pure(); }));
}

// An arm of a choice reads elements only where it is chosen.
TEST(CoarseValues, ThatAreReadConditionallyStay) {
  Surface s;
  const Expr row = s.row(fraction(x), y / cell);
  s.surface(x, y) = call_op(Op::if_then_else, Float(32), {x < y, row, 0.0f});
  EXPECT_TRUE(rows_of(whole(s.surface), SumOrder::Free).empty());
}

TEST(CoarseValues, OfStrictSumsStay) {
  Surface s;
  s.written_out();
  Func strict("strict");
  strict(x, y) = strict_float(s.surface.function()->pure->values[0]);
  EXPECT_TRUE(rows_of(whole(strict), SumOrder::Free).empty());
}

TEST(CoarseValues, OfFewPointsStay) {
  Surface s;
  s.nested();
  EXPECT_EQ(rows_of(whole(s.surface, size, 48), SumOrder::Free).size(), 1u);
  Surface small;
  small.nested();
  EXPECT_TRUE(rows_of(whole(small.surface, 32, 48), SumOrder::Free).empty());
}

// ---- bounds ----

TEST(CoarseValues, ReadNoMoreOfGridsThanTheValueDid) {
  const auto required = [](const FuncPtr& output, ImageParam image) {
    image.reset();
    Func(output).infer_input_bounds(std::vector<int32_t>{});
    const Buffer<> found = image.get();
    return std::vector<int>{found.dim(0).min(), found.dim(0).extent(), found.dim(1).min(),
                            found.dim(1).extent()};
  };
  ImageParam image(Float(32), 2, "image");
  Func surface("surface");
  const auto row = [&](const Expr& j) {
    return lerp(image(x / cell - 1, j), image(x / cell, j), fraction(x));
  };
  surface(x, y) = lerp(row(y / cell + 1), row(y / cell + 3), fraction(y));
  const FuncPtr output = whole(surface, 61, 53).function();
  const FuncPtr factored = with_invariant_factors({output}).front();
  ASSERT_EQ(rows_in(factored).size(), 1u);
  EXPECT_EQ(required(factored, image), required(output, image));
}

}  // namespace
}  // namespace retrograde::transform
