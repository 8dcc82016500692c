// Tests gradients of programs that read coarse grids: by values of the grid, by weights and by positions.
#include "transform/coarse_values.h"

#include <string>
#include <vector>

#include "gradient/gradient_check.h"
#include "support/facts.h"
#include "support/variables.h"
#include "transform/invariant_factors.h"

namespace retrograde::gradient {
namespace {

constexpr int cell = 16, knots = 4, size = 48;

const Var k("k");

Expr fraction(const Expr& at) { return cast<float>(at % cell) * (1.0f / cell); }

std::vector<std::string> rows_of(const Derivative& d) {
  std::vector<std::string> names;
  for (const Func& f : d.funcs()) {
    const std::string name = graph::without_numbers(f.name());
    if (name.ends_with("_rows")) names.push_back(name);
  }
  return names;
}

// The operations of the whole gradient.
double operations(const Derivative& d) {
  return d.operations().gradient.operations().value().value_or(-1);
}

struct Surface {
  explicit Surface(bool is_scheduled = false) : is_scheduled_(is_scheduled) {}
  Buffer<float> grid = random_image({knots, knots}, -1, 1, 1);
  Buffer<float> table = random_image({cell, 2}, 0, 1, 2);
  Func surface{"surface"};

  Func as_sum() {
    RDom r(0, 2, 0, 2, "r");
    surface(x, y) = 0.0f;
    surface(x, y) +=
        table(x % cell, r.x) * table(y % cell, r.y) * grid(x / cell + r.x, y / cell + r.y);
    return loss();
  }
  Func written_out() {
    Expr sum = 0.0f;
    for (int b = 0; b < 2; ++b) {
      for (int a = 0; a < 2; ++a)
        sum += table(x % cell, a) * table(y % cell, b) * grid(x / cell + a, y / cell + b);
    }
    surface(x, y) = sum;
    return loss();
  }
  Func nested() {
    const auto row = [&](const Expr& j) {
      return lerp(grid(x / cell, j), grid(x / cell + 1, j), fraction(x));
    };
    surface(x, y) = lerp(row(y / cell), row(y / cell + 1), table(y % cell, 0));
    return loss();
  }

 private:
  Func loss() {
    if (is_scheduled_) surface.compute_root();
    return weighted_sum(surface, {size, size});
  }
  bool is_scheduled_;
};

TEST(CoarseGrids, SumsOverGrids) {
  Surface s, scheduled(true);
  const Func loss = s.as_sum();
  const Derivative d = propagate_adjoints(loss), before = propagate_adjoints(scheduled.as_sum());
  EXPECT_EQ(rows_of(d), (std::vector<std::string>{"surface_rows"}));
  EXPECT_TRUE(rows_of(before).empty()) << "a Func with directives is left alone";
  EXPECT_LT(operations(d), 0.7 * operations(before));
  expect_gradient(loss, d, s.grid);
  expect_gradient(loss, d, s.table);
  expect_fact(d.explanations(), Fact::Version, s.surface.name(),
              "\"surface_rows\" keeps what \"surface\" reads of a coarse grid, for each of its "
              "coordinates along y");
}

TEST(CoarseGrids, TermsWrittenOut) {
  Surface s;
  const Func loss = s.written_out();
  const Derivative d = propagate_adjoints(loss);
  EXPECT_EQ(rows_of(d).size(), 1u);
  expect_gradient(loss, d, s.grid);
}

TEST(CoarseGrids, NestedInterpolation) {
  Surface s;
  const Func loss = s.nested();
  const Derivative d = propagate_adjoints(loss);
  EXPECT_EQ(rows_of(d).size(), 1u);
  expect_gradient(loss, d, s.grid);
  expect_gradient(loss, d, s.table);
}

// The adjoint of rows scatters along y alone: an element's column of the grid is known.
TEST(CoarseGrids, GridsAtRegularPositions) {
  Surface s;
  const auto at = [](const Expr& v) { return cast<float>(v) * 0.07f; };
  const auto row = [&](const Expr& j) {
    const Expr i = cast<int>(floor(at(x)));
    return lerp(s.grid(clamp(i, 0, knots - 1), clamp(j, 0, knots - 1)),
                s.grid(clamp(i + 1, 0, knots - 1), clamp(j, 0, knots - 1)), at(x) - floor(at(x)));
  };
  const Expr j = cast<int>(floor(at(y)));
  s.surface(x, y) = lerp(row(j), row(j + 1), at(y) - floor(at(y)));
  const Func loss = weighted_sum(s.surface, {size, size});
  const Derivative d = propagate_adjoints(loss);
  ASSERT_EQ(rows_of(d).size(), 1u);
  expect_gradient(loss, d, s.grid);
}

// Two components of a field of displacements, which are used together.
TEST(CoarseGrids, Deformations) {
  Buffer<float> control = random_image({4, 4, 2}, -1, 1, 3);
  Func moved("moved"), wave("wave");
  RDom r(0, 2, 0, 2, "r");
  const auto hat = [](const Expr& v, const Expr& tap) {
    return select(tap == 0, 1.0f - fraction(v), fraction(v));
  };
  moved(x, y, c) = 0.0f;
  moved(x, y, c) -= hat(x, r.x) * hat(y, r.y) * control(x / cell + r.x, y / cell + r.y, c);
  wave(x, y) = sin(cast<float>(x) * 0.125f + moved(x, y, 0)) * cos(moved(x, y, 1));
  const Func loss = weighted_sum(wave, {36, 36});
  const Derivative d = propagate_adjoints(loss);
  ASSERT_EQ(rows_of(d).size(), 1u);
  expect_gradient(loss, d, control);
}

TEST(CoarseGrids, RequestedAdjointsOfTheUsersFuncsAreFound) {
  Surface s, other(true);
  const Derivative d = propagate_adjoints(s.as_sum(), {.wrt = {s.surface, s.grid}});
  const Derivative expected =
      propagate_adjoints(other.as_sum(), {.wrt = {other.surface, other.grid}});
  ASSERT_FALSE(rows_of(d).empty());
  const oracle::Region all{{0, 0}, {size, size}};
  const oracle::Array found = evaluate(d(s.surface), all),
                      wanted = evaluate(expected(other.surface), all);
  all.for_each([&](const std::vector<int>& point) {
    EXPECT_DOUBLE_EQ(found.at(point).scalar.as_double(), wanted.at(point).scalar.as_double());
  });
}

// Compiled with the default schedule, on one thread and on several.
TEST(CoarseGrids, CompiledGradients) {
  Surface s, other(true);
  const Buffer<float> found = Func(propagate_adjoints(s.as_sum())(s.grid)).realize({knots, knots});
  const Buffer<float> expected =
      Func(propagate_adjoints(other.as_sum())(other.grid)).realize({knots, knots});
  for (int j = 0; j < knots; ++j) {
    for (int i = 0; i < knots; ++i)
      EXPECT_NEAR(found(i, j), expected(i, j), 1e-4f * (1 + std::abs(expected(i, j))));
  }
}

}  // namespace
}  // namespace retrograde::gradient
