// Sums with strong products, in which a first factor of 0 makes the product 0 whatever the second is. Naively they take
// a multiplication, a mask and an addition, because the mask keeps the other two from fusing. Here they fuse:
//
//   acc + strong_mul(a, b)  =  a != 0 ? fma(a, b, acc) : acc      one masked instruction
//                           =  fma(a, a != 0 ? b : 0, acc)        on machines without masks
//
// A factor that several products share is compared once. As for other products that fuse, the last bit of the sum and
// the sign of a zero depend on the machine.
//
// Only products that are added to a stored value fuse. A difference of two products of equal size, such as the partials
// of a normalised vector, must be exactly 0 if the products are equal. If one of them were unrounded, its rounding
// error would remain (Higham, Accuracy and Stability of Numerical Algorithms, 2nd ed., section 2.6).
#include <llvm/IR/Intrinsics.h>

#include "codegen/values/values.h"

namespace retrograde::codegen {

using namespace ir;

static const Call* as_strong_product(const Expr& e) { return as_op(e, Op::strong_mul); }

// Whether `e` is a stored value, or the sum of one and strong products.
static bool is_running_sum(const Expr& e) {
  if (e.as<Load>()) return true;
  const auto* sum = e.as<Binary>();
  if (!sum || (sum->kind != Kind::Add && sum->kind != Kind::Sub)) return false;
  return (as_strong_product(sum->b) && is_running_sum(sum->a)) ||
         (sum->kind == Kind::Add && as_strong_product(sum->a) && is_running_sum(sum->b));
}

Value* sum_with_strong_product(Values& values, const Binary& e) {
  const bool is_sum = e.kind == Kind::Add || e.kind == Kind::Sub;
  const Type type = e.a.type();
  if (!is_sum || !type.is_float() || is_half(type) ||
      !values.c.b.getFastMathFlags().allowContract())
    return nullptr;
  const Call* product = as_strong_product(e.b);
  const bool is_second = product != nullptr;
  if (!is_second && e.kind == Kind::Add) product = as_strong_product(e.a);
  if (!product || !is_running_sum(is_second ? e.a : e.b)) return nullptr;
  Value* sum = values.of(is_second ? e.a : e.b);
  Value *a = values.of(product->args[0]), *b = values.of(product->args[1]);
  Value *zero = float_constant(a, 0.0), *counts = values.c.b.CreateFCmpUNE(a, zero);
  const auto fused = [&](Value* factor) -> Value* {
    Value* first = e.kind == Kind::Sub ? values.c.b.CreateFNeg(a) : a;
    return values.c.b.CreateIntrinsic(llvm::Intrinsic::fmuladd, {a->getType()},
                                      {first, factor, sum});
  };
  if (values.c.e.machine.has_avx512()) return values.c.b.CreateSelect(counts, fused(b), sum);
  return fused(values.c.b.CreateSelect(counts, b, zero));
}

}  // namespace retrograde::codegen
