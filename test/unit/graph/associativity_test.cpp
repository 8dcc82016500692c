// The updates that the associativity prover accepts, with their identities, and those that it
// refuses.
#include "analysis/associativity.h"

#include <gtest/gtest.h>

#include <cmath>

#include "ir/build.h"
#include "ir/equal.h"
#include "ir/print.h"
#include "support/errors.h"

namespace retrograde::graph {
namespace {

Expr v(const char* name, Type type = Int(32)) { return variable(name, type); }

AssociativityProof prove(const std::vector<Expr>& values) {
  std::vector<std::string> xs;
  for (size_t i = 0; i < values.size(); i++) xs.push_back("x" + std::to_string(i));
  return prove_associative(values, xs);
}

const Expr x0 = v("x0"), x1 = v("x1"), x2 = v("x2"), x3 = v("x3");
const Expr a = v("a"), b = v("b"), c = v("c"), d = v("d");

void expect_op(const std::vector<Expr>& values, const std::vector<Expr>& identity,
               bool commutative = true) {
  const AssociativityProof proof = prove(values);
  ASSERT_TRUE(proof.op) << proof.why_not;
  EXPECT_EQ(proof.op->commutative, commutative);
  for (size_t i = 0; i < values.size(); i++) {
    if (!identity[i].defined()) {
      EXPECT_FALSE(proof.op->identity[i].defined());
      continue;
    }
    ASSERT_TRUE(proof.op->identity[i].defined());
    EXPECT_TRUE(equal(proof.op->identity[i], identity[i])) << proof.op->identity[i];
  }
}

void expect_refused(const std::vector<Expr>& values, const std::string& evidence) {
  const AssociativityProof proof = prove(values);
  ASSERT_FALSE(proof.op);
  expect_mentions(proof.why_not, {evidence});
}

TEST(Associativity, SumsHoweverTheyAreWritten) {
  expect_op({x0 + a}, {0});
  expect_op({a + x0}, {0});
  expect_op({x0 - a}, {0});
  expect_op({x0 + a - b + c}, {0});
  expect_op({x0 + a * b + cast(Int(32), v("f", Float(32)))}, {0});
  expect_op({select(a < b, x0 + a, x0)}, {0});
}

TEST(Associativity, TheIdentityOfFloatSumsIsMinusZero) {
  const Expr x = v("x0", Float(32));
  const AssociativityProof proof = prove({x + v("a", Float(32))});
  ASSERT_TRUE(proof.op);
  EXPECT_TRUE(std::signbit(proof.op->identity[0].as<FloatImm>()->value));
}

TEST(Associativity, ProductsAndExtremes) {
  expect_op({x0 * a}, {1});
  expect_op({a * x0 * b}, {1});
  expect_op({min(x0, a)}, {Int(32).max()});
  expect_op({min(min(a, x0), b)}, {Int(32).max()});
  expect_op({max(a, x0)}, {Int(32).min()});
  const Expr x = v("x0", UInt(8)), g = v("a", UInt(8));
  expect_op({max(x, g)}, {make_zero(UInt(8))});
  expect_op({select(g < x, g, x)}, {UInt(8).max()});
  expect_op({select(x >= g, x, g)}, {make_zero(UInt(8))});
}

TEST(Associativity, LogicAndBits) {
  const Expr x = v("x0", Bool()), g = v("a", Bool());
  expect_op({x && g}, {const_true()});
  expect_op({g || x}, {const_false()});
  expect_op({x != g}, {const_false()});
  expect_op({call_op(Op::bitwise_and, {x0, a})}, {-1});
  expect_op({call_op(Op::bitwise_or, {a, x0})}, {0});
  expect_op({call_op(Op::bitwise_xor, {x0, call_op(Op::bitwise_xor, {a, b})})}, {0});
}

TEST(Associativity, ArgminInSeveralSpellings) {
  expect_op({min(x0, a), select(a < x0, b, x1)}, {Int(32).max(), Expr()});
  expect_op({select(a < x0, a, x0), select(a < x0, b, x1)}, {Int(32).max(), Expr()});
  expect_op({select(x0 <= a, x0, a), select(x0 <= a, x1, b)}, {Int(32).max(), Expr()});
  expect_op({min(a, x0), select(x0 < a, x1, b)}, {Int(32).max(), Expr()});
  expect_op({select(!(a < x0), x0, a), select(a >= x0, x1, b)}, {Int(32).max(), Expr()});
}

TEST(Associativity, ArgmaxWithTwoCoordinatesAndAPredicate) {
  expect_op({max(x0, a), select(a > x0, b, x1), select(a > x0, c, x2)},
            {Int(32).min(), Expr(), Expr()});
  const Expr better = v("p", Bool()) && a > x0;
  expect_op({select(better, a, x0), select(better, b, x1)}, {Int(32).min(), Expr()});
}

TEST(Associativity, TheKeyMayStandAnywhere) {
  expect_op({select(b < x1, a, x0), min(b, x1)}, {Expr(), Int(32).max()});
}

TEST(Associativity, ArgminWithTiesBrokenByPlaceIsExact) {
  const Expr better = a < x0 || (a == x0 && b < x1);
  const AssociativityProof proof = prove({select(better, a, x0), select(better, b, x1)});
  ASSERT_TRUE(proof.op) << proof.why_not;
  EXPECT_TRUE(proof.op->commutative);
}

TEST(Associativity, IndependentValuesArePutTogether) {
  expect_op({x0 + a, x1 * b, min(x2, c)}, {0, 1, Int(32).max()});
  expect_op({x0 + a, x1}, {0, Expr()});
}

TEST(Associativity, ComplexMultiplication) {
  expect_op({x0 * a - x1 * b, x0 * b + x1 * a}, {1, 0});
  expect_op({a * x0 - b * x1, a * x1 + b * x0}, {1, 0});
  const Expr p = v("x0", Float(32)), q = v("x1", Float(32));
  const Expr g = v("a", Float(32)), h = v("b", Float(32));
  expect_op({p * g - q * h, p * h + q * g}, {1.0f, 0.0f});
}

TEST(Associativity, MapsComposeButDoNotCommute) {
  expect_op({x0 * a, x1 * a + b}, {1, 0}, false);                                  // x -> a x + b
  expect_op({a * x0, a * x1 + b * x0}, {1, 0});                                    // dual numbers
  expect_op({x0 * a + x1 * c, x0 * b + x1 * d, x2 * a + x3 * c, x2 * b + x3 * d},  // 2x2 matrices
            {1, 0, 0, 1}, false);
  expect_op({a * x0 + b * x2, a * x1 + b * x3, c * x0 + d * x2, c * x1 + d * x3}, {1, 0, 0, 1},
            false);
}

TEST(Associativity, CountAndSumOfSquares) { expect_op({x0 + 1, x1 + a, x2 + a * a}, {0, 0, 0}); }

TEST(Associativity, RefusesWhatIsNotAssociative) {
  expect_refused({a - x0}, "form x = ");
  expect_refused({x0 * 2 + a}, "is not proven");
  expect_refused({x0 / a}, "divides");
  expect_refused({min(x0 + a, 255)}, "is not proven");
  expect_refused({a}, "replaces the old value");
  expect_refused({x0 * x0 + a}, "is not proven");
  expect_refused({cast(Int(32), cast(Int(64), x0) + cast(Int(64), a))}, "converts");
  expect_refused({call_op(Op::abs, {x0})}, "abs");
  expect_refused({x0 * a + x1 * b, x0 * b + x1 * a + 1}, "is not proven");
  expect_refused({select(x0 == a, x0 + 1, max(x0, a))}, "is not proven");
}

}  // namespace
}  // namespace retrograde::graph
