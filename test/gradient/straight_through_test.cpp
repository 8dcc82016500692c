// Tests straight-through forms: the value is bit for bit the first operand's, also as machine code, and the derivative
// is the second operand's, in both modes.
#include "autodiff/straight_through.h"

#include "autodiff/tangents.h"
#include "gradient/gradient_check.h"
#include "support/errors.h"

namespace retrograde::gradient {
namespace {

constexpr int n = 16;

TEST(StraightThrough, HasTheValueOfOneAndTheDerivativeOfTheOther) {
  Var x("x");
  Buffer<float> a = random_image({n}, -2, 2, 1), v = random_image({n}, -1, 1, 2), ones(n);
  ones.fill(1);
  for (int i = 0; i < n; ++i) a(i) *= 1.1f;  // products that round
  Func f("f"), rounded("rounded"), surrogate("surrogate");
  rounded(x) = round(a(x) * 3.0f) / 3.0f;
  surrogate(x) = a(x) * a(x) * 0.7f;
  f(x) = straight_through(round(a(x) * 3.0f) / 3.0f, a(x) * a(x) * 0.7f);
  Buffer<float> found = f.realize({n}), expected = rounded.realize({n});
  for (int i = 0; i < n; ++i) EXPECT_EQ(found(i), expected(i));

  oracle::Array reverse = evaluate(propagate_adjoints(f, ones)(a), {{0}, {n}});
  oracle::Array forward = evaluate(propagate_tangents(f, {{a, v}})(f), {{0}, {n}});
  for (int i = 0; i < n; ++i) {
    EXPECT_NEAR(reverse.at({i}).scalar.as_double(), 2 * 0.7 * a(i), 1e-6);
    EXPECT_NEAR(forward.at({i}).scalar.as_double(), 2 * 0.7 * a(i) * v(i), 1e-6);
  }
}

TEST(StraightThrough, TakesFloatsOfOneType) {
  Var x("x");
  expect_error({"int32", "floats of one type"}, [&] { straight_through(Expr(x), Expr(x)); });
  expect_error({"float32", "float64"}, [&] { straight_through(Expr(1.0f), Expr(1.0)); });
}

}  // namespace
}  // namespace retrograde::gradient
