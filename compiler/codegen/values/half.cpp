// float16 and bfloat16: conversion of bit patterns to and from float, rounding to nearest even.
//
// bfloat16 never uses the processor's conversion: x86's treats denormals as zero. float16 uses F16C or NEON if
// available, else integer arithmetic. So old machines get vector code too and need no library.
#include <llvm/IR/Intrinsics.h>

#include "codegen/emitter.h"

namespace retrograde::codegen {
namespace {

llvm::Type* lanes_of_int(Emitter& e, Value* like, unsigned bits) {
  return with_lanes(e.b.getIntNTy(bits), lanes_of(like));
}

Value* bfloat_to_float(Emitter& e, Value* bits) {
  Value* wide = e.b.CreateZExt(bits, lanes_of_int(e, bits, 32));
  return bits_as_float(e, e.b.CreateShl(wide, int_constant(wide, 16)));
}

// Rounds away the low `drop` bits of x, ties to even: (x + half - 1 + lowest kept bit) >> drop.
Value* round_shift(Emitter& e, Value* x, int drop) {
  Value* lowest = e.b.CreateAnd(e.b.CreateLShr(x, int_constant(x, drop)), int_constant(x, 1));
  Value* sum =
      e.b.CreateAdd(e.b.CreateAdd(x, int_constant(x, (int64_t{1} << (drop - 1)) - 1)), lowest);
  return e.b.CreateLShr(sum, int_constant(x, drop));
}

Value* float_to_bfloat(Emitter& e, Value* number) {
  Value* x = bits_as_integer(e, number);
  Value* rounded = round_shift(e, x, 16);
  // A NaN keeps its sign and high payload, and becomes quiet so that it cannot round to infinity.
  Value* quiet = e.b.CreateOr(e.b.CreateLShr(x, int_constant(x, 16)), int_constant(x, 0x40));
  Value* is_nan = e.b.CreateFCmpUNO(number, number);
  return e.b.CreateTrunc(e.b.CreateSelect(is_nan, quiet, rounded), lanes_of_int(e, x, 16));
}

// Shifts significand and exponent into place. Multiplying by 2^112 corrects the exponent's bias and normalizes
// denormals, exactly. Infinity and NaN have the largest exponent and are selected separately, because the
// multiplication cannot produce them.
Value* half_to_float_by_bits(Emitter& e, Value* bits) {
  Contraction off(e, false);
  Value* x = e.b.CreateZExt(bits, lanes_of_int(e, bits, 32));
  Value* magnitude = e.b.CreateShl(e.b.CreateAnd(x, int_constant(x, 0x7fff)), int_constant(x, 13));
  Value* scaled = e.b.CreateFMul(bits_as_float(e, magnitude),
                                 float_constant(bits_as_float(e, magnitude), 0x1p112));
  Value* is_special = e.b.CreateICmpUGE(magnitude, int_constant(x, 0x7c00 << 13));
  Value* special = e.b.CreateOr(magnitude, int_constant(x, 0x7f800000));
  Value* result = e.b.CreateSelect(is_special, special, bits_as_integer(e, scaled));
  Value* sign = e.b.CreateShl(e.b.CreateAnd(x, int_constant(x, 0x8000)), int_constant(x, 16));
  return bits_as_float(e, e.b.CreateOr(result, sign));
}

// Normal results: rebias the exponent and round 13 bits away; a carry correctly runs into the exponent, up to infinity.
// Results below 2^-14: adding 0.5 aligns the half's last bit with the float's, so the addition does the rounding.
Value* float_to_half_by_bits(Emitter& e, Value* number) {
  Contraction off(e, false);
  Value* x = bits_as_integer(e, number);
  Value* magnitude = e.b.CreateAnd(x, int_constant(x, 0x7fffffff));
  Value* normal = round_shift(e, e.b.CreateSub(magnitude, int_constant(x, 112 << 23)), 13);
  Value* capped = e.b.CreateBinaryIntrinsic(llvm::Intrinsic::umin, normal, int_constant(x, 0x7c00));
  Value* shifted = e.b.CreateFAdd(bits_as_float(e, magnitude), float_constant(number, 0.5));
  Value* denormal = e.b.CreateSub(bits_as_integer(e, shifted), int_constant(x, 126 << 23));
  Value* is_small = e.b.CreateICmpULT(magnitude, int_constant(x, 113 << 23));
  Value* result = e.b.CreateSelect(is_small, denormal, capped);
  Value* payload =
      e.b.CreateAnd(e.b.CreateLShr(magnitude, int_constant(x, 13)), int_constant(x, 0x3ff));
  Value* is_nan = e.b.CreateFCmpUNO(number, number);
  result = e.b.CreateSelect(is_nan, e.b.CreateOr(payload, int_constant(x, 0x7e00)), result);
  Value* sign = e.b.CreateAnd(e.b.CreateLShr(x, int_constant(x, 16)), int_constant(x, 0x8000));
  return e.b.CreateTrunc(e.b.CreateOr(result, sign), lanes_of_int(e, x, 16));
}

// Rounding to odd: truncation that sets the last bit if anything was cut off. Rounding the result to nearest in a
// format at least two bits narrower equals rounding the double directly (Boldo and Melquiond, 2008).
Value* double_to_float_odd(Emitter& e, Value* number) {
  auto* single = with_lanes(e.b.getFloatTy(), lanes_of(number));
  Value* nearest = e.b.CreateFPTrunc(number, single);
  Value* back = e.b.CreateFPExt(nearest, number->getType());
  Value* x = bits_as_integer(e, nearest);
  Value* is_inexact = e.b.CreateFCmpUNE(back, number);  // NaN: setting its last bit is harmless
  Value* is_above = e.b.CreateFCmpOGT(e.b.CreateUnaryIntrinsic(llvm::Intrinsic::fabs, back),
                                      e.b.CreateUnaryIntrinsic(llvm::Intrinsic::fabs, number));
  Value* truncated = e.b.CreateSub(x, e.b.CreateZExt(is_above, x->getType()));
  return bits_as_float(e, e.b.CreateOr(truncated, e.b.CreateZExt(is_inexact, x->getType())));
}

}  // namespace

Value* half_to_float(Emitter& e, Type half, Value* bits) {
  if (half.is_bfloat()) return bfloat_to_float(e, bits);
  if (!e.machine.has_f16c()) return half_to_float_by_bits(e, bits);
  Value* number = e.b.CreateBitCast(bits, with_lanes(e.b.getHalfTy(), lanes_of(bits)));
  return e.b.CreateFPExt(number, with_lanes(e.b.getFloatTy(), lanes_of(bits)));
}

Value* float_to_half(Emitter& e, Type half, Value* number) {
  if (half.is_bfloat()) return float_to_bfloat(e, number);
  if (!e.machine.has_f16c()) return float_to_half_by_bits(e, number);
  Value* rounded = e.b.CreateFPTrunc(number, with_lanes(e.b.getHalfTy(), lanes_of(number)));
  return e.b.CreateBitCast(rounded, lanes_of_int(e, number, 16));
}

Value* double_to_half(Emitter& e, Type half, Value* number) {
  return float_to_half(e, half, double_to_float_odd(e, number));
}

}  // namespace retrograde::codegen
