// The pure operators that take a few instructions: bit operations, shifts, absolute values, lerp, rounding,
// classification.
#include <llvm/IR/Intrinsics.h>

#include "codegen/emitter.h"
#include "diagnostics/error.h"

namespace retrograde::codegen {
namespace {

using ir::Op;
using llvm::Intrinsic::ID;

// ---- shifts ----

// `amount` is in [0, infinity), unsigned, and has the value's width.
Value* shift_by_unsigned(Emitter& e, Type type, Value* value, Value* amount, bool left) {
  Value* limit = int_constant(amount, type.bits() - 1);
  Value* safe = e.b.CreateBinaryIntrinsic(llvm::Intrinsic::umin, amount, limit);
  if (!left && type.is_int()) return e.b.CreateAShr(value, safe);  // beyond the width: the sign
  Value* shifted = left ? e.b.CreateShl(value, safe) : e.b.CreateLShr(value, safe);
  return e.b.CreateSelect(e.b.CreateICmpUGT(amount, limit), int_constant(value, 0), shifted);
}

Value* shift(Emitter& e, Type type, Type amount_type, Value* value, Value* amount, bool left) {
  if (amount_type.bits() != type.bits()) {  // a wider amount must not lose its high bits
    const Type wide = amount_type.with_bits(std::max(amount_type.bits(), type.bits()));
    amount = convert(e, wide, amount_type, amount);
    if (wide.bits() > type.bits()) {
      const Type same(wide.code(), type.bits(), wide.lanes());
      amount = convert_saturating(e, same, wide, amount);
    }
  }
  if (amount_type.is_uint()) return shift_by_unsigned(e, type, value, amount, left);
  Value* is_negative = e.b.CreateICmpSLT(amount, int_constant(amount, 0));
  Value* forward = shift_by_unsigned(e, type, value, amount, left);
  Value* backward = shift_by_unsigned(e, type, value, e.b.CreateNeg(amount), !left);
  return e.b.CreateSelect(is_negative, backward, forward);
}

// ---- absolute values ----

Value* absolute(Emitter& e, Type type, Value* value) {
  if (is_half(type)) return e.b.CreateAnd(value, int_constant(value, 0x7fff));
  if (type.is_float()) return e.b.CreateUnaryIntrinsic(llvm::Intrinsic::fabs, value);
  if (!type.is_int()) return value;
  return e.b.CreateBinaryIntrinsic(llvm::Intrinsic::abs, value, e.b.getFalse());
}

Value* absolute_difference(Emitter& e, Type type, Value* a, Value* b) {
  if (type.is_float()) return absolute(e, type, binary(e, ir::Kind::Sub, type, a, b));
  return e.b.CreateSub(binary(e, ir::Kind::Max, type, a, b), binary(e, ir::Kind::Min, type, a, b));
}

// ---- lerp ----

// The weight as a float of `type`. The largest value of an integer weight counts as 1.
Value* unit_weight(Emitter& e, Type type, Type weight_type, Value* weight) {
  Value* number = convert(e, type, weight_type, weight);
  if (weight_type.is_float()) return number;
  return e.b.CreateFDiv(number,
                        float_constant(number, static_cast<double>(weight_type.max_uint())));
}

Value* lerp_floats(Emitter& e, Type type, Type weight_type, Value* a, Value* b, Value* weight) {
  const Type wide = is_half(type) ? Float(32, type.lanes()) : type;
  Value* w = unit_weight(e, wide, weight_type, weight);
  Value* rest = e.b.CreateFSub(float_constant(w, 1.0), w);
  Value* sum = add_floats(e, e.b.CreateFMul(convert(e, wide, type, a), rest),
                          e.b.CreateFMul(convert(e, wide, type, b), w));
  return convert(e, type, wide, sum);
}

Value* lerp_bools(Emitter& e, Type weight_type, Value* a, Value* b, Value* weight) {
  Value* is_above;
  if (weight_type.is_float()) {
    Value* w = convert(e, Float(64, weight_type.lanes()), weight_type, weight);
    is_above = e.b.CreateFCmpOGT(w, float_constant(w, 0.5));
  } else {
    is_above = e.b.CreateICmpUGT(
        weight, int_constant(weight, static_cast<int64_t>(weight_type.max_uint() / 2)));
  }
  return e.b.CreateSelect(is_above, b, a);
}

// A weight in fixed point of the values' width, rounded down (ir/operators.cpp states the rule).
Value* fixed_point_weight(Emitter& e, Type fixed, Type weight_type, Value* weight) {
  if (!weight_type.is_float()) {
    const uint64_t ratio = weight_type.max_uint() / fixed.max_uint();
    Value* scaled = e.b.CreateUDiv(weight, int_constant(weight, static_cast<int64_t>(ratio)));
    return e.b.CreateTrunc(scaled, llvm_type(e, fixed));
  }
  const bool in_double = weight_type.bits() > 32 || fixed.bits() > 16;
  const Type wide = Float(in_double ? 64 : 32, fixed.lanes());
  Value* w = convert(e, wide, weight_type, weight);
  w = e.b.CreateFMul(w, float_constant(w, static_cast<double>(fixed.max_uint())));
  return convert_saturating(e, fixed, wide, w);
}

// a +- round(|b - a| * w / max). The product, plus half of max, fits the sum of both widths. There are no ties because
// max is odd.
Value* lerp_integers(Emitter& e, Type type, Type weight_type, Value* a, Value* b, Value* weight) {
  if (weight_type.is_float() || weight_type.bits() > type.bits()) {
    const Type fixed = UInt(type.bits(), type.lanes());
    weight = fixed_point_weight(e, fixed, weight_type, weight);
    weight_type = fixed;
  }
  int bits = 16;
  while (bits < type.bits() + weight_type.bits()) bits *= 2;
  RETROGRADE_ASSERT(bits <= 64, "lerp of ", to_string(type), " with a weight of ",
                    to_string(weight_type));
  auto* wide = llvm_type(e, UInt(bits, type.lanes()));
  Value* distance = e.b.CreateZExt(absolute_difference(e, type, a, b), wide);
  Value* product = e.b.CreateMul(distance, e.b.CreateZExt(weight, wide));
  const auto max = static_cast<int64_t>(weight_type.max_uint());
  Value* rounded = e.b.CreateUDiv(e.b.CreateAdd(product, int_constant(product, max / 2)),
                                  int_constant(product, max));
  Value* step = e.b.CreateTrunc(rounded, a->getType());
  Value* is_down = binary(e, ir::Kind::LT, type, b, a);
  return e.b.CreateSelect(is_down, e.b.CreateSub(a, step), e.b.CreateAdd(a, step));
}

Value* lerp(Emitter& e, Type type, Type weight_type, Value* a, Value* b, Value* weight) {
  if (type.is_float()) return lerp_floats(e, type, weight_type, a, b, weight);
  if (type.is_bool()) return lerp_bools(e, weight_type, a, b, weight);
  return lerp_integers(e, type, weight_type, a, b, weight);
}

// ---- rounding, classification, strong zero ----

Value* by_intrinsic(Emitter& e, ID id, Type type, Value* value) {
  if (!is_half(type)) return e.b.CreateUnaryIntrinsic(id, value);
  return float_to_half(e, type, e.b.CreateUnaryIntrinsic(id, half_to_float(e, type, value)));
}

Value* classify(Emitter& e, Op op, Type type, Value* value) {
  Value* number = is_half(type) ? half_to_float(e, type, value) : value;
  if (op == Op::is_nan) return e.b.CreateFCmpUNO(number, number);
  Value* size = e.b.CreateUnaryIntrinsic(llvm::Intrinsic::fabs, number);
  Value* infinity = llvm::ConstantFP::getInfinity(size->getType());
  return op == Op::is_inf ? e.b.CreateFCmpOEQ(size, infinity) : e.b.CreateFCmpOLT(size, infinity);
}

// Machine code implements a select of zero as a masked multiplication or division.
Value* strong(Emitter& e, llvm::Instruction::BinaryOps op, Type type, Value* adjoint,
              Value* partial) {
  const Type wide = is_half(type) ? Float(32, type.lanes()) : type;
  Value* a = convert(e, wide, type, adjoint);
  Value* is_zero = e.b.CreateFCmpOEQ(a, float_constant(a, 0.0));
  Value* result = e.b.CreateBinOp(op, a, convert(e, wide, type, partial));
  return convert(e, type, wide, e.b.CreateSelect(is_zero, float_constant(a, 0.0), result));
}

// ---- fma ----

// The vector form of the one in ir/operators.cpp: a sum in double whose last bit records that something was cut off.
Value* sum_rounded_to_odd(Emitter& e, Value* product, Value* c) {
  Value* sum = e.b.CreateFAdd(product, c);
  Value* taken = e.b.CreateFSub(sum, product);
  Value* lost =
      e.b.CreateFAdd(e.b.CreateFSub(product, e.b.CreateFSub(sum, taken)), e.b.CreateFSub(c, taken));
  Value* zero = float_constant(sum, 0.0);
  Value* bits = bits_as_integer(e, sum);
  Value* is_even =
      e.b.CreateICmpEQ(e.b.CreateAnd(bits, int_constant(bits, 1)), int_constant(bits, 0));
  Value* is_inexact = e.b.CreateFCmpONE(lost, zero);
  Value* is_outwards =
      e.b.CreateICmpEQ(e.b.CreateFCmpOGT(lost, zero), e.b.CreateFCmpOGT(sum, zero));
  Value* step = e.b.CreateSelect(is_outwards, int_constant(bits, 1), int_constant(bits, -1));
  Value* odd = bits_as_float(e, e.b.CreateAdd(bits, step));
  return e.b.CreateSelect(e.b.CreateAnd(is_inexact, is_even), odd, sum);
}

// If the processor has no FMA of this width, computes in double, in which products of narrower numbers are exact.
Value* fused(Emitter& e, Type type, Value* a, Value* b, Value* c) {
  if (type.bits() == 64 || (type == Float(32, type.lanes()) && e.machine.has_fma()))
    return e.b.CreateIntrinsic(llvm::Intrinsic::fma, {a->getType()}, {a, b, c});
  const Contraction off(e, false);
  const Type wide = Float(64, type.lanes());
  const auto widened = [&](Value* v) { return convert(e, wide, type, v); };
  return convert(e, type, wide,
                 sum_rounded_to_odd(e, e.b.CreateFMul(widened(a), widened(b)), widened(c)));
}

}  // namespace

Value* simple_operator(Emitter& e, Op op, Type result, const std::vector<Type>& types,
                       const std::vector<Value*>& args) {
  const Type type = types.empty() ? result : types[0];
  const auto arg = [&](size_t i) { return args.at(i); };
  switch (op) {
    case Op::bitwise_and:
      return e.b.CreateAnd(arg(0), arg(1));
    case Op::bitwise_or:
      return e.b.CreateOr(arg(0), arg(1));
    case Op::bitwise_xor:
      return e.b.CreateXor(arg(0), arg(1));
    case Op::bitwise_not:
      return e.b.CreateNot(arg(0));
    case Op::shift_left:
      return shift(e, type, types.at(1), arg(0), arg(1), true);
    case Op::shift_right:
      return shift(e, type, types.at(1), arg(0), arg(1), false);
    case Op::abs:
      return absolute(e, type, arg(0));
    case Op::absd:
      return absolute_difference(e, type, arg(0), arg(1));
    case Op::lerp:
      return lerp(e, type, types.at(2), arg(0), arg(1), arg(2));
    case Op::fma:
      return fused(e, type, arg(0), arg(1), arg(2));
    case Op::floor:
      return by_intrinsic(e, llvm::Intrinsic::floor, type, arg(0));
    case Op::ceil:
      return by_intrinsic(e, llvm::Intrinsic::ceil, type, arg(0));
    case Op::round:
      return by_intrinsic(e, llvm::Intrinsic::roundeven, type, arg(0));
    case Op::trunc:
      return by_intrinsic(e, llvm::Intrinsic::trunc, type, arg(0));
    case Op::sqrt:
      return by_intrinsic(e, llvm::Intrinsic::sqrt, type, arg(0));
    case Op::is_nan:
    case Op::is_inf:
    case Op::is_finite:
      return classify(e, op, type, arg(0));
    case Op::popcount:
      return e.b.CreateUnaryIntrinsic(llvm::Intrinsic::ctpop, arg(0));
    case Op::count_leading_zeros:
      return e.b.CreateBinaryIntrinsic(llvm::Intrinsic::ctlz, arg(0), e.b.getFalse());
    case Op::count_trailing_zeros:
      return e.b.CreateBinaryIntrinsic(llvm::Intrinsic::cttz, arg(0), e.b.getFalse());
    case Op::saturating_cast:
      return convert_saturating(e, result, type, arg(0));
    case Op::strong_mul:
      return strong(e, llvm::Instruction::FMul, type, arg(0), arg(1));
    case Op::strong_div:
      return strong(e, llvm::Instruction::FDiv, type, arg(0), arg(1));
    default:
      return nullptr;
  }
}

}  // namespace retrograde::codegen
