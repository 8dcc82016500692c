// Code for binary operators and conversions.
#include <llvm/IR/Intrinsics.h>
#include <llvm/IR/IntrinsicsX86.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "codegen/emitter.h"
#include "diagnostics/error.h"

namespace retrograde::codegen {
namespace {

using ir::Kind;

Value* float_mod(Emitter& e, Value* a, Value* b) {
  Contraction off(e, false);  // each step rounds
  Value* whole = e.b.CreateUnaryIntrinsic(llvm::Intrinsic::floor, e.b.CreateFDiv(a, b));
  return e.b.CreateFSub(a, e.b.CreateFMul(b, whole));
}

Value* float_binary(Emitter& e, Kind kind, Value* a, Value* b) {
  switch (kind) {
    case Kind::Add:
      return add_floats(e, a, b);
    case Kind::Sub:
      return subtract_floats(e, a, b);
    case Kind::Mul:
      return e.b.CreateFMul(a, b);
    case Kind::Div:
      return e.b.CreateFDiv(a, b);
    case Kind::Mod:
      return float_mod(e, a, b);
    // The exact semantics of x86's minps and maxps: the second operand if unordered or equal.
    case Kind::Min:
      return e.b.CreateSelect(e.b.CreateFCmpOLT(a, b), a, b);
    case Kind::Max:
      return e.b.CreateSelect(e.b.CreateFCmpOGT(a, b), a, b);
    case Kind::EQ:
      return e.b.CreateFCmpOEQ(a, b);
    case Kind::NE:
      return e.b.CreateFCmpUNE(a, b);
    case Kind::LT:
      return e.b.CreateFCmpOLT(a, b);
    case Kind::LE:
      return e.b.CreateFCmpOLE(a, b);
    case Kind::GT:
      return e.b.CreateFCmpOGT(a, b);
    case Kind::GE:
      return e.b.CreateFCmpOGE(a, b);
    default:
      internal_error(text(ir::kind_name(kind), " of floats"));
  }
}

Value* int_compare(Emitter& e, Kind kind, bool is_signed, Value* a, Value* b) {
  using P = llvm::CmpInst::Predicate;
  switch (kind) {
    case Kind::EQ:
      return e.b.CreateICmpEQ(a, b);
    case Kind::NE:
      return e.b.CreateICmpNE(a, b);
    case Kind::LT:
      return e.b.CreateICmp(is_signed ? P::ICMP_SLT : P::ICMP_ULT, a, b);
    case Kind::LE:
      return e.b.CreateICmp(is_signed ? P::ICMP_SLE : P::ICMP_ULE, a, b);
    case Kind::GT:
      return e.b.CreateICmp(is_signed ? P::ICMP_SGT : P::ICMP_UGT, a, b);
    case Kind::GE:
      return e.b.CreateICmp(is_signed ? P::ICMP_SGE : P::ICMP_UGE, a, b);
    default:
      internal_error(text(ir::kind_name(kind), " of integers"));
  }
}

Value* int_binary(Emitter& e, Kind kind, Type type, Value* a, Value* b) {
  const bool is_signed = type.is_int();
  switch (kind) {
    case Kind::Add:
      return e.b.CreateAdd(a, b);
    case Kind::Sub:
      return e.b.CreateSub(a, b);
    case Kind::Mul:
      return e.b.CreateMul(a, b);
    case Kind::Div:
      return divide(e, type, a, b);
    case Kind::Mod:
      return modulo(e, type, a, b);
    case Kind::And:
      return e.b.CreateAnd(a, b);
    case Kind::Or:
      return e.b.CreateOr(a, b);
    case Kind::Min:
      return e.b.CreateBinaryIntrinsic(is_signed ? llvm::Intrinsic::smin : llvm::Intrinsic::umin, a,
                                       b);
    case Kind::Max:
      return e.b.CreateBinaryIntrinsic(is_signed ? llvm::Intrinsic::smax : llvm::Intrinsic::umax, a,
                                       b);
    default:
      return int_compare(e, kind, is_signed, a, b);
  }
}

// The product is rounded to half before the subtraction, as in the wider types.
Value* half_mod(Emitter& e, Type type, Value* a, Value* b) {
  const auto step = [&](Value* number) {
    return half_to_float(e, type, float_to_half(e, type, number));
  };
  Contraction off(e, false);
  Value *wide_a = half_to_float(e, type, a), *wide_b = half_to_float(e, type, b);
  Value* floor =
      e.b.CreateUnaryIntrinsic(llvm::Intrinsic::floor, step(e.b.CreateFDiv(wide_a, wide_b)));
  Value* whole = step(e.b.CreateFMul(wide_b, floor));
  return float_to_half(e, type, e.b.CreateFSub(wide_a, whole));
}

Value* half_binary(Emitter& e, Kind kind, Type type, Value* a, Value* b) {
  if (kind == Kind::Mod) return half_mod(e, type, a, b);
  Value *wide_a = half_to_float(e, type, a), *wide_b = half_to_float(e, type, b);
  if (kind == Kind::Min) return e.b.CreateSelect(e.b.CreateFCmpOLT(wide_a, wide_b), a, b);
  if (kind == Kind::Max) return e.b.CreateSelect(e.b.CreateFCmpOGT(wide_a, wide_b), a, b);
  Value* result = float_binary(e, kind, wide_a, wide_b);
  return kind >= Kind::EQ ? result : float_to_half(e, type, result);
}

// Converts as PTX's cvt does (PTX ISA, cvt): numbers out of range become the nearest bound. NaN becomes 0, except that
// with a 64-bit source or result only the sign bit is set.
Value* as_a_device_converts(Emitter& e, bool as_unsigned, llvm::Type* wide, Value* number) {
  Value* integer =
      e.b.CreateIntrinsic(as_unsigned ? llvm::Intrinsic::fptoui_sat : llvm::Intrinsic::fptosi_sat,
                          {wide, number->getType()}, {number});
  const unsigned bits = wide->getScalarSizeInBits();
  if (bits < 64 && !number->getType()->getScalarType()->isDoubleTy()) return integer;
  Value* of_nan = llvm::ConstantInt::get(wide, llvm::APInt::getSignMask(bits));
  return e.b.CreateSelect(e.b.CreateFCmpUNO(number, number), of_nan, integer);
}

Value* float_to_integer(Emitter& e, Type to, Value* number) {
  // LLVM's result for a number out of range is poison, which would spread to every use of the lane. Freezing makes it
  // an arbitrary but fixed number.
  const int bits = std::max(to.bits(), 32);
  auto* wide = with_lanes(e.b.getIntNTy(static_cast<unsigned>(bits)), to.lanes());
  const bool as_unsigned = to.is_uint() && to.bits() >= 32;
  if (e.machine.device == Machine::Device::Simt) {
    return e.b.CreateTrunc(as_a_device_converts(e, as_unsigned, wide, number), llvm_type(e, to));
  }
  Value* integer = as_unsigned ? e.b.CreateFPToUI(number, wide) : e.b.CreateFPToSI(number, wide);
  return e.b.CreateTrunc(e.b.CreateFreeze(integer), llvm_type(e, to));
}

Value* integer_to_float(Emitter& e, Type to, Type from, Value* value) {
  auto* type = llvm_type(e, to);
  return from.is_int() ? e.b.CreateSIToFP(value, type) : e.b.CreateUIToFP(value, type);
}

// Converts through double, which holds every integer of up to 32 bits; for other types it rounds as the IR specifies.
Value* convert_to_half(Emitter& e, Type to, Type from, Value* value) {
  const Type wide = Float(64, to.lanes());
  if (from.is_float() && from.bits() == 64) return double_to_half(e, to, value);
  if (from.is_float() && from.bits() == 32) return float_to_half(e, to, value);
  if (is_half(from)) return float_to_half(e, to, half_to_float(e, from, value));
  return double_to_half(e, to, integer_to_float(e, wide, from, value));
}

Value* convert_from_float(Emitter& e, Type to, Value* number) {
  if (to.is_bool()) return e.b.CreateFCmpUNE(number, float_constant(number, 0.0));
  if (!to.is_float()) return float_to_integer(e, to, number);
  return e.b.CreateFPCast(number, llvm_type(e, to));
}

}  // namespace

Value* binary(Emitter& e, Kind kind, Type type, Value* a, Value* b) {
  if (is_half(type)) return half_binary(e, kind, type, a, b);
  if (type.is_float()) return float_binary(e, kind, a, b);
  if (type.is_handle()) return int_compare(e, kind, false, a, b);
  return int_binary(e, kind, type, a, b);
}

Value* convert(Emitter& e, Type to, Type from, Value* value) {
  if (to == from) return value;
  if (is_half(to)) return convert_to_half(e, to, from, value);
  if (is_half(from)) return convert_from_float(e, to, half_to_float(e, from, value));
  if (from.is_float()) return convert_from_float(e, to, value);
  if (to.is_float()) return integer_to_float(e, to, from, value);
  if (to.is_bool()) return e.b.CreateICmpNE(value, int_constant(value, 0));
  return e.b.CreateIntCast(value, llvm_type(e, to), from.is_int());
}

Value* reinterpret(Emitter& e, Type to, Type from, Value* value) {
  auto* type = llvm_type(e, to);
  if (to.is_handle() == from.is_handle()) return e.b.CreateBitCast(value, type);
  return to.is_handle() ? e.b.CreateIntToPtr(value, type) : e.b.CreatePtrToInt(value, type);
}

// Uses the widest registers that a and b fill; the last register may be partly filled.
Value* add_products_in_pairs(Emitter& e, Value* a, Value* b) {
  const int lanes = lanes_of(a), widest = e.machine.has_avx512_words() ? 32
                                          : e.machine.has_avx2()       ? 16
                                                                       : 8;
  const int width = std::clamp(static_cast<int>(std::bit_ceil(unsigned(lanes))), 8, widest);
  const auto id = width == 32   ? llvm::Intrinsic::x86_avx512_pmaddw_d_512
                  : width == 16 ? llvm::Intrinsic::x86_avx2_pmadd_wd
                                : llvm::Intrinsic::x86_sse2_pmadd_wd;
  std::vector<Value*> parts;
  for (int start = 0; start < lanes; start += width) {
    parts.push_back(
        e.b.CreateIntrinsic(id, {}, {slice(e, a, start, width), slice(e, b, start, width)}));
  }
  return slice(e, concat(e, parts), 0, lanes / 2);
}

// ---- saturating_cast ----

// To float16, whose largest finite value is 65504; NaN stays NaN. Wider float types need no clamp: their range ends at
// infinity.
static Value* saturated_float16(Emitter& e, Type to, Type from, Value* value) {
  Value* bits = convert(e, to, from, value);
  constexpr int64_t without_sign = 0x7fff, infinity = 0x7c00;
  Value* is_inf = e.b.CreateICmpEQ(e.b.CreateAnd(bits, int_constant(bits, without_sign)),
                                   int_constant(bits, infinity));
  return e.b.CreateSelect(is_inf, e.b.CreateSub(bits, int_constant(bits, 1)), bits);
}

static Value* clamp_integer(Emitter& e, Type to, Type from, Value* value) {
  // Clamp to a bound of the target type only if the source type can exceed it.
  if (from.is_int() && !to.can_represent(from.min_int())) {
    value = e.b.CreateBinaryIntrinsic(llvm::Intrinsic::smax, value,
                                      int_constant(value, to.is_uint() ? 0 : to.min_int()));
  }
  const uint64_t high = to.max_uint(), from_high = from.max_uint();
  if (from_high > high) {
    const auto id = from.is_int() ? llvm::Intrinsic::smin : llvm::Intrinsic::umin;
    value = e.b.CreateBinaryIntrinsic(id, value, int_constant(value, static_cast<int64_t>(high)));
  }
  return e.b.CreateIntCast(value, llvm_type(e, to), from.is_int());
}

// For vectors on x86, where LLVM scalarises its own saturating intrinsics into five instructions per lane. NaN becomes
// 0. The clamp is on floats, so no wider integers are needed. If the upper bound 2^n - 1 is not a float, it is selected
// after the conversion.
static Value* saturate_vector(Emitter& e, Type to, Value* number) {
  const auto real = [&](double value) { return float_constant(number, value); };
  const double end = std::ldexp(1.0, to.is_int() ? to.bits() - 1 : to.bits());
  const int digits = number->getType()->getScalarType()->isDoubleTy() ? 53 : 24;
  const bool is_exact = to.bits() - (to.is_int() ? 1 : 0) <= digits;
  const double low = to.is_int() ? -end : 0,
               high = is_exact ? end - 1 : end - std::ldexp(end, -digits);
  Value* ordered = number;
  if (to.is_int()) ordered = e.b.CreateSelect(e.b.CreateFCmpORD(number, number), number, real(0));
  // NaN becomes the lower bound, which is 0 for the types that reach this line.
  Value* clamped = e.b.CreateSelect(e.b.CreateFCmpOGT(ordered, real(low)), ordered, real(low));
  clamped = e.b.CreateSelect(e.b.CreateFCmpOLT(clamped, real(high)), clamped, real(high));
  Value* integer = float_to_integer(e, to, clamped);
  if (is_exact) return integer;
  return e.b.CreateSelect(e.b.CreateFCmpOGE(number, real(end)),
                          int_constant(integer, static_cast<int64_t>(to.max_uint())), integer);
}

Value* convert_saturating(Emitter& e, Type to, Type from, Value* value) {
  if (to == from) return value;
  if (to.element_of() == Float(16)) return saturated_float16(e, to, from, value);
  if (to.is_float()) return convert(e, to, from, value);
  if (from.is_bool() || to.is_bool()) {
    if (from.is_float() || !to.is_bool()) return convert(e, to, from, value);
    // Negative numbers clamp to false.
    return from.is_int() ? e.b.CreateICmpSGT(value, int_constant(value, 0))
                         : e.b.CreateICmpNE(value, int_constant(value, 0));
  }
  if (!from.is_float()) return clamp_integer(e, to, from, value);
  Value* number = is_half(from) ? half_to_float(e, from, value) : value;
  // Only AVX-512 has vector conversions to 64-bit integers.
  const bool has_conversion = to.bits() < 64 || e.machine.has_avx512_words();
  if (to.is_vector() && e.machine.is_x86() && has_conversion) return saturate_vector(e, to, number);
  const auto id = to.is_int() ? llvm::Intrinsic::fptosi_sat : llvm::Intrinsic::fptoui_sat;
  return e.b.CreateIntrinsic(id, {llvm_type(e, to), number->getType()}, {number});
}

}  // namespace retrograde::codegen
