// Division and modulus of integers, rounded so that the remainder is never negative.
//
// By a positive constant c, signed:  sign = a < 0 ? -1 : 0;  q = ((a ^ sign) /u c) ^ sign
//   For a < 0, a ^ sign = -a - 1 >= 0 and  -1 - (-a - 1) / c = floor(a / c). LLVM turns the
//   unsigned division into a multiplication, in vectors too.
// By a negative constant:  q = -(a / |c|), since a = q c + r with the same r.
// By a variable, vectors of up to 32 bits: in a float type that holds both operands, float32 for up to
//   16 bits, else double. The truncated quotient is exact: a / b differs from the next integer by at
//   least 1 / |b|; the rounding error is at most |a / b| 2^-24, or 2^-53, less than 1 / |b|.
// By a variable otherwise: LLVM's division, with its two undefined cases handled apart.
#include <llvm/IR/Constants.h>

#include "codegen/emitter.h"

namespace retrograde::codegen {
namespace {

// The constant that all lanes of `value` hold, or null.
const llvm::ConstantInt* uniform_constant(Value* value) {
  if (auto* scalar = llvm::dyn_cast<llvm::ConstantInt>(value)) return scalar;
  auto* vector = llvm::dyn_cast<llvm::Constant>(value);
  if (!vector || !vector->getType()->isVectorTy()) return nullptr;
  return llvm::dyn_cast_or_null<llvm::ConstantInt>(vector->getSplatValue());
}

Value* sign_mask(Emitter& e, Type type, Value* a) {
  return e.b.CreateAShr(a, int_constant(a, type.bits() - 1));
}

Value* divide_by_constant(Emitter& e, Type type, Value* a, const llvm::APInt& divisor) {
  if (divisor.isZero()) return int_constant(a, 0);
  if (!type.is_int()) return e.b.CreateUDiv(a, llvm::ConstantInt::get(a->getType(), divisor));
  const llvm::APInt magnitude =
      divisor.abs();  // unsigned, so that it also holds for the most negative number
  Value* quotient;
  if (magnitude.isPowerOf2() && !magnitude.isMinSignedValue()) {
    quotient = e.b.CreateAShr(a, int_constant(a, magnitude.logBase2()));
  } else {
    Value* sign = sign_mask(e, type, a);
    Value* positive = e.b.CreateXor(a, sign);
    quotient = e.b.CreateXor(
        e.b.CreateUDiv(positive, llvm::ConstantInt::get(a->getType(), magnitude)), sign);
  }
  return divisor.isNegative() ? e.b.CreateNeg(quotient) : quotient;
}

Value* truncating_in_floats(Emitter& e, Type type, Value* a, Value* b) {
  const bool is_narrow = type.bits() < 32, is_signed = type.is_int();
  auto* wide = with_lanes(is_narrow ? e.b.getFloatTy() : e.b.getDoubleTy(), type.lanes());
  auto* integer = with_lanes(e.b.getInt32Ty(), type.lanes());
  Contraction off(e, false);
  const auto widened = [&](Value* v) {
    return is_signed ? e.b.CreateSIToFP(v, wide) : e.b.CreateUIToFP(v, wide);
  };
  Value* quotient = e.b.CreateFDiv(widened(a), widened(b));
  if (is_narrow) return e.b.CreateTrunc(e.b.CreateFPToSI(quotient, integer), a->getType());
  if (!is_signed) return e.b.CreateFPToUI(quotient, integer);
  // Only the quotient of the most negative number by -1 does not fit.
  Value* is_minus_one = e.b.CreateICmpEQ(b, int_constant(b, -1));
  Value* fitting = e.b.CreateFreeze(e.b.CreateFPToSI(quotient, integer));
  return e.b.CreateSelect(is_minus_one, e.b.CreateNeg(a), fitting);
}

// Rounds toward zero; b is not 0.
Value* truncating(Emitter& e, Type type, Value* a, Value* b) {
  if (type.is_vector() && type.bits() >= 8 && type.bits() <= 32)
    return truncating_in_floats(e, type, a, b);
  if (!type.is_int()) return e.b.CreateUDiv(a, b);
  Value* is_minus_one = e.b.CreateICmpEQ(b, int_constant(b, -1));
  Value* quotient = e.b.CreateSDiv(a, e.b.CreateSelect(is_minus_one, int_constant(b, 1), b));
  return e.b.CreateSelect(is_minus_one, e.b.CreateNeg(a), quotient);
}

struct Divided {
  Value *quotient, *remainder;
};

Divided divide_by_variable(Emitter& e, Type type, Value* a, Value* b) {
  Value *zero = int_constant(b, 0), *is_zero = e.b.CreateICmpEQ(b, zero);
  Value* divisor = e.b.CreateSelect(is_zero, int_constant(b, 1), b);
  Value* quotient = truncating(e, type, a, divisor);
  Value* remainder = e.b.CreateSub(a, e.b.CreateMul(quotient, divisor));
  if (type.is_int()) {
    // If the remainder is negative, add |b| to it, and move the quotient one step away from b's sign.
    Value* is_low = sign_mask(e, type, remainder);
    Value* b_sign = sign_mask(e, type, divisor);
    Value* step = e.b.CreateOr(b_sign, int_constant(b, 1));  // -1 or 1
    Value* magnitude = e.b.CreateSub(e.b.CreateXor(divisor, b_sign), b_sign);
    quotient = e.b.CreateSub(quotient, e.b.CreateAnd(step, is_low));
    remainder = e.b.CreateAdd(remainder, e.b.CreateAnd(magnitude, is_low));
  }
  return {e.b.CreateSelect(is_zero, zero, quotient), e.b.CreateSelect(is_zero, zero, remainder)};
}

}  // namespace

Value* divide(Emitter& e, Type type, Value* a, Value* b) {
  if (const auto* constant = uniform_constant(b))
    return divide_by_constant(e, type, a, constant->getValue());
  return divide_by_variable(e, type, a, b).quotient;
}

Value* modulo(Emitter& e, Type type, Value* a, Value* b) {
  const auto* constant = uniform_constant(b);
  if (!constant) return divide_by_variable(e, type, a, b).remainder;
  const llvm::APInt& divisor = constant->getValue();
  if (divisor.isZero()) return int_constant(a, 0);
  const llvm::APInt magnitude = type.is_int() ? divisor.abs() : divisor;
  if (magnitude.isPowerOf2())
    return e.b.CreateAnd(a, llvm::ConstantInt::get(a->getType(), magnitude - 1));
  Value* quotient = divide_by_constant(e, type, a, magnitude);
  return e.b.CreateSub(a, e.b.CreateMul(quotient, llvm::ConstantInt::get(a->getType(), magnitude)));
}

}  // namespace retrograde::codegen
