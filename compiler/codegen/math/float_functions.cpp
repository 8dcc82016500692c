// exp, log, tanh and erf of float32, inlined on machines with FMA. A call would keep no vector register and would hide from
// LLVM that the loops of several elements can overlap: in a loop over exponentials that was two thirds of the time.
//
// Errors, measured over all floats: exp 0.89, log 0.85, tanh 1.04, erf 1.04 ULP. Every operation is rounded alike in every vector
// width, so a scalar tail agrees with the vector body. No case takes a branch.
//
// Method: W. J. Cody and W. Waite, Software Manual for the Elementary Functions (1980), chapters 5, 6 and 13, without
// their tables. A polynomial approximates the terms after the leading ones with minimal maximum error (Lawson 1961).
// Where a sum would lose digits, its rounding error is kept and added to the smaller terms (Dekker 1971).
#include <llvm/IR/Intrinsics.h>
#include <llvm/IR/IntrinsicsX86.h>

#include <algorithm>
#include <initializer_list>

#include "codegen/emitter.h"

namespace retrograde::codegen {
namespace {

using ir::Op;

// Float arithmetic with constants, in which only `fma` fuses.
class Floats {
 public:
  Floats(Emitter& e, llvm::Type* type) : e(e), type_(type), contraction_(e, false) {}

  Value* constant(double value) { return float_constant(type_, value); }
  Value* infinity() { return llvm::ConstantFP::getInfinity(type_); }
  Value* mul(Value* a, Value* b) { return e.b.CreateFMul(a, b); }
  Value* mul(Value* a, double b) { return mul(a, constant(b)); }
  Value* add(Value* a, Value* b) { return e.b.CreateFAdd(a, b); }
  Value* add(Value* a, double b) { return add(a, constant(b)); }
  Value* sub(Value* a, Value* b) { return e.b.CreateFSub(a, b); }
  Value* fma(Value* a, Value* b, Value* c) {
    return e.b.CreateIntrinsic(llvm::Intrinsic::fma, {type_}, {a, b, c});
  }
  Value* fma(Value* a, double b, Value* c) { return fma(a, constant(b), c); }
  Value* less(Value* a, Value* b) { return e.b.CreateFCmpOLT(a, b); }
  Value* select(Value* condition, Value* a, Value* b) { return e.b.CreateSelect(condition, a, b); }
  // NaN stays NaN.
  Value* clamp(Value* x, double low, double high) {
    x = select(less(x, constant(low)), constant(low), x);
    return select(less(constant(high), x), constant(high), x);
  }
  Value* size(Value* x) { return e.b.CreateUnaryIntrinsic(llvm::Intrinsic::fabs, x); }
  // ... + c[1] x^(n - 2) + c[0] x^(n - 1), the coefficient of the highest power first, by Horner's rule.
  Value* polynomial(Value* x, std::initializer_list<double> c) {
    Value* result = constant(*c.begin());
    for (const double* next = c.begin() + 1; next != c.end(); ++next)
      result = fma(result, x, constant(*next));
    return result;
  }

  Emitter& e;

 private:
  llvm::Type* type_;
  Contraction contraction_;
};

// p 2^n for whole n in [-151, 129] and p in [0.7, 1.5], rounded once; NaN if both are NaN. Two factors: 2^n alone may be no float.
Value* scale(Floats& f, Value* p, Value* n) {
  llvm::IRBuilder<>& b = f.e.b;
  const bool has_instruction = f.e.machine.has_avx512() && lanes_of(p) == 16;
  if (has_instruction && !llvm::isa<llvm::Constant>(n)) {
    constexpr uint64_t all_lanes = 0xffff, current_rounding = 4;
    return b.CreateIntrinsic(llvm::Intrinsic::x86_avx512_mask_scalef_ps_512, {},
                             {p, n, p, b.getInt16(all_lanes), b.getInt32(current_rounding)});
  }
  constexpr int64_t bias = 127, mantissa_bits = 23;
  // Any exponent will do for a NaN, which p is then.
  Value* whole = b.CreateFreeze(b.CreateFPToSI(n, bits_as_integer(f.e, n)->getType()));
  Value* half = b.CreateAShr(whole, int_constant(whole, 1));
  const auto power = [&](Value* exponent) {
    Value* biased = b.CreateAdd(exponent, int_constant(whole, bias));
    return bits_as_float(f.e, b.CreateShl(biased, int_constant(whole, mantissa_bits)));
  };
  return f.mul(f.mul(p, power(half)), power(b.CreateSub(whole, half)));
}

// x = n ln2 + r, |r| <= ln2 / 2;  exp(x) = 2^n (1 + r + r^2 Q(r)). n ln2 is subtracted in two parts, of which the first
// leaves an exact difference; the second is added to the small terms.
Value* float_exp(Floats& f, Value* x) {
  constexpr double log2_e = 0x1.715476p+0, ln2_high = 0x1.62e43p-1, ln2_low = -0x1.05c61p-29;
  constexpr double is_zero_below = -104, is_infinite_above = 89;
  x = f.clamp(x, is_zero_below, is_infinite_above);
  Value* n = f.e.b.CreateUnaryIntrinsic(llvm::Intrinsic::roundeven, f.mul(x, log2_e));
  Value* high = f.fma(n, -ln2_high, x);
  Value* low = f.mul(n, -ln2_low);
  Value* r = f.add(high, low);
  Value* q =
      f.polynomial(r, {0x1.6a2352p-10, 0x1.123a6cp-7, 0x1.5558f4p-5, 0x1.55549p-3, 0x1.fffffcp-2});
  Value* p = f.add(f.add(high, f.fma(f.mul(r, r), q, low)), 1.0);
  return scale(f, p, n);
}

// x = 2^k m, m in [2/3, 4/3), f = m - 1;  log(x) = k ln2 + f - f^2 / 2 + f^3 P(f). The first part of ln2 has 16 bits, so
// that its products with k are exact.
Value* float_log(Floats& f, Value* x) {
  constexpr double ln2_high = 0x1.62e4p-1, ln2_low = 0x1.7f7d1cp-20, least_normal = 0x1p-126;
  constexpr int64_t two_thirds = 0x3f2aaaab, mantissa_bits = 23;
  llvm::IRBuilder<>& b = f.e.b;
  Value* is_denormal = f.less(x, f.constant(least_normal));
  Value* normal = f.select(is_denormal, f.mul(x, 0x1p23), x);
  Value* bits = bits_as_integer(f.e, normal);
  const auto integer = [&](int64_t value) { return int_constant(bits, value); };
  Value* exponent = b.CreateAShr(b.CreateSub(bits, integer(two_thirds)), integer(mantissa_bits));
  Value* m = bits_as_float(f.e, b.CreateSub(bits, b.CreateShl(exponent, integer(mantissa_bits))));
  Value* k = f.add(b.CreateSIToFP(exponent, x->getType()),
                   f.select(is_denormal, f.constant(-23), f.constant(0)));
  Value* off = f.add(m, -1.0);
  Value* p = f.polynomial(off, {-0x1.080592p-3, 0x1.1e66cp-3, -0x1.f3113cp-4, 0x1.1ed716p-3,
                                -0x1.559dccp-3, 0x1.99d028p-3, -0x1.fffefp-3, 0x1.555506p-2});
  Value* square = f.mul(off, off);
  Value* tail = f.fma(f.mul(off, square), p, f.mul(square, -0.5));
  Value* whole = f.mul(k, ln2_high);
  Value* sum = f.add(whole, off);
  Value* lost = f.add(f.sub(whole, sum), off);
  Value* result = f.add(sum, f.add(lost, f.fma(k, ln2_low, tail)));
  // Infinity and NaN return x itself.
  result = f.select(b.CreateFCmpULT(x, f.infinity()), result, x);
  result = f.select(f.less(x, f.constant(0)), llvm::ConstantFP::getNaN(x->getType()), result);
  result = f.select(b.CreateFCmpOEQ(x, f.constant(0)),
                    llvm::ConstantFP::getInfinity(x->getType(), true), result);
  return f.select(b.CreateFCmpUNO(x, x), x, result);
}

// Near 0 x + x^3 P(x^2), elsewhere 1 - 2 / (exp(2 x) + 1).
Value* float_tanh(Floats& f, Value* x) {
  constexpr double near = 0.8, is_one_above = 10;
  Value *size = f.size(x), *square = f.mul(size, size);
  Value* p = f.polynomial(square, {0x1.9f6e38p-10, -0x1.e59754p-8, 0x1.5d0728p-6, -0x1.b92884p-5,
                                   0x1.110b3cp-3, -0x1.55553ep-2});
  Value* small = f.fma(f.mul(size, square), p, size);
  Value* power = float_exp(f, f.mul(f.clamp(size, 0, is_one_above), 2.0));
  Value* quotient = f.e.b.CreateFDiv(f.constant(2), f.add(power, 1.0));
  Value* large = f.sub(f.constant(1), quotient);
  Value* result = f.select(f.less(size, f.constant(near)), small, large);
  return f.e.b.CreateBinaryIntrinsic(llvm::Intrinsic::copysign, result, x);
}

// Near 0 x + x P(x^2), elsewhere 1 - exp(-g) with g = x + x Q(x), whose rounding error is kept.
Value* float_erf(Floats& f, Value* x) {
  constexpr double near = 0.95, is_one_above = 4;
  Value *size = f.size(x), *square = f.mul(size, size);
  Value* p = f.polynomial(square, {0x1.574e44p-14, -0x1.a88d6p-11, 0x1.54965ep-8, -0x1.b8096p-6,
                                   0x1.ce2dcap-4, -0x1.812742p-2, 0x1.06eba8p-3});
  Value* small = f.fma(size, p, size);
  Value* far = f.clamp(size, 0, is_one_above);
  Value* q = f.polynomial(far, {0x1.9e06dp-17, -0x1.5e2d7p-12, 0x1.e367b2p-9, -0x1.86e8dcp-6,
                                0x1.b39c9ap-4, 0x1.45297ap-1, 0x1.0781ep-3});
  Value* g = f.fma(far, q, far);
  Value* lost = f.fma(far, q, f.sub(far, g));
  Value* power = float_exp(f, f.e.b.CreateFNeg(g));
  Value* rest = f.fma(f.e.b.CreateFNeg(power), lost, power);
  Value* result = f.select(f.less(size, f.constant(near)), small, f.sub(f.constant(1), rest));
  return f.e.b.CreateBinaryIntrinsic(llvm::Intrinsic::copysign, result, x);
}

Value* piece_of(Emitter& e, Op op, Value* x) {
  Floats f(e, x->getType());
  switch (op) {
    case Op::exp:
      return float_exp(f, x);
    case Op::log:
      return float_log(f, x);
    case Op::tanh:
      return float_tanh(f, x);
    default:
      return float_erf(f, x);
  }
}

}  // namespace

bool is_inlined_for_floats(const Machine& machine, Op op) {
  const bool is_here = op == Op::exp || op == Op::log || op == Op::tanh || op == Op::erf;
  return is_here && !machine.is_device() && machine.has_fma();
}

// One register at a time: the chains of different pieces overlap.
Value* float_function(Emitter& e, Op op, Value* x) {
  const int lanes = lanes_of(x), most = std::max(4, e.machine.vector_bits / 32);
  if (lanes <= most) return piece_of(e, op, x);
  std::vector<Value*> pieces;
  for (int start = 0; start < lanes; start += most)
    pieces.push_back(piece_of(e, op, slice(e, x, start, std::min(most, lanes - start))));
  return concat(e, pieces);
}

}  // namespace retrograde::codegen
