// Checks the gradients of a fixed set of random expressions; fuzz_forms continues without end.
#include <gtest/gtest.h>

#include "frontend/language/expr_ops.h"
#include "gradient/forms/check_form.h"
#include "gradient/forms/expressions.h"
#include "ir/build.h"

namespace retrograde::gradient {
namespace {

// Alternates between float32 and double; one expression in forty is also checked as machine code.
TEST(StableFormsRandom, GradientsOfFormsAndNearMissesAreThoseOfDualNumbers) {
  FormResult total;
  for (uint64_t seed = 0; seed < 1000; ++seed) {
    Choices choices(seed);
    const Expr e = make_form(choices, seed % 2 ? Float(64) : Float(32));
    const FormResult result = check_form(e, seed, seed % 40 == 0);
    EXPECT_EQ(result.finding, "") << "seed " << seed;
    total += result;
  }
  EXPECT_GT(total.checked, 10 * total.ill_conditioned);
  EXPECT_GT(total.checked, 20'000);
}

// Below one ratio: an expression that only looks like a smooth maximum (its distance is that of one operand to itself),
// an entropy, and a norm that has one component twice.
TEST(StableFormsRandom, FormsThatShareNodesUnderARatioTakeNothingFromEachOther) {
  for (const Type type : {Float(32), Float(64)}) {
    const auto num = [&](double value) { return ir::make_const(type, value); };
    const Expr x = ir::variable("x", type), y = ir::variable("y", type),
               z = ir::variable("z", type);
    const Expr one = num(1), a = abs(x * z) + num(0.05), b = abs(num(0.901564) * x) + num(0.2);
    const Expr u = a * log(a / b), l = log(abs(z + x) / (abs(z * z) + num(0.1)));
    const Expr smooth = max(x, u) + log(one + exp(-abs(u - u)));
    const Expr rest = z / (one + abs(y)) / sqrt(l * l + l * l);
    for (uint64_t seed = 0; seed < 20; ++seed) {
      const FormResult result = check_form((smooth - rest) / (smooth + rest), seed, seed == 0);
      EXPECT_EQ(result.finding, "");
      EXPECT_GT(result.checked, 0);
    }
  }
}

}  // namespace
}  // namespace retrograde::gradient
