// pow of float32, inlined: log2, product and exp2 in double, rounded once at the end, so that the
// error is that of the two polynomials (below 3e-9) beside half a unit of the last place. Doubles
// hold 2^u for every u that float32 can tell from infinity or 0, so that nothing is scaled twice.
// No case has a branch, which would keep LLVM from moving what depends on y alone out of loops.
//
// Method: W. J. Cody and W. Waite, Software Manual for the Elementary Functions (1980), chapters
// 5 to 7, without their tables; polynomials of least maximum relative error (Remez).
// Rejected: log2 in two floats, about as many instructions and in need of FMA for its bits.
#include <llvm/IR/Intrinsics.h>

#include <algorithm>

#include "codegen/emitter.h"

namespace retrograde::codegen {
namespace {

// Arithmetic whose bits are the same in every width: FMA is written out where there is one, and
// nothing else may fuse.
class Doubles {
 public:
  explicit Doubles(Emitter& e) : e_(e), contraction_(e, false) {}
  Value* fma(Value* a, Value* b, Value* c) {
    if (!e_.machine.has_fma()) return e_.b.CreateFAdd(e_.b.CreateFMul(a, b), c);
    return e_.b.CreateIntrinsic(llvm::Intrinsic::fma, {a->getType()}, {a, b, c});
  }
  // c[0] + c[1] x + ..., an odd number of terms: Horner's rule over pairs, half as long a chain as
  // over terms.
  Value* polynomial(Value* x, const std::vector<double>& c) {
    const auto constant = [&](size_t i) { return float_constant(x, c[i]); };
    Value *square = e_.b.CreateFMul(x, x), *result = constant(c.size() - 1);
    for (size_t i = c.size() - 1; i >= 2; i -= 2)
      result = fma(result, square, fma(x, constant(i - 1), constant(i - 2)));
    return result;
  }

 private:
  Emitter& e_;
  Contraction contraction_;
};

// x = 2^k m, m in [sqrt(1/2), sqrt(2)), of a finite x > 0, which as a double is no denormal; of 0,
// k is -1023 and m is 1.
struct Parts {
  Value *k, *m;
};

Parts split(Emitter& e, Value* x) {
  constexpr int64_t one = 0x3ff0000000000000, sqrt_half = 0x3fe6a09e667f3bcd;
  constexpr int64_t mantissa_mask = 0xfffffffffffff, two_to_52 = 0x4330000000000000;
  Value* bits = bits_as_integer(e, x);
  const auto integer = [&](int64_t value) { return int_constant(bits, value); };
  Value* moved = e.b.CreateAdd(bits, integer(one - sqrt_half));
  Value* mantissa = e.b.CreateAnd(moved, integer(mantissa_mask));
  // The biased exponent as the last bits of 2^52 + it: AVX2 converts no integers of 64 bits.
  Value* biased = e.b.CreateOr(e.b.CreateLShr(moved, integer(52)), integer(two_to_52));
  return {e.b.CreateFSub(bits_as_float(e, biased), float_constant(x, 0x1p52 + 1023)),
          bits_as_float(e, e.b.CreateAdd(mantissa, integer(sqrt_half)))};
}

// y log2(x) = y k + y s P(s^2), s = (m - 1) / (m + 1), |s| <= 0.172; 0 only of 1.
Value* times_log2(Emitter& e, Value* y, Value* x) {
  Doubles d(e);
  const auto [k, m] = split(e, x);
  Value* one = float_constant(x, 1.0);
  Value* s = e.b.CreateFDiv(e.b.CreateFSub(m, one), e.b.CreateFAdd(m, one));
  Value* p = d.polynomial(e.b.CreateFMul(s, s),
                          {0x1.71547652bede5p+1, 0x1.ec709d12e151ap-1, 0x1.27777fda6996cp-1,
                           0x1.a58d8fbfbfbdcp-2, 0x1.5ce7cd9d80bd4p-2});
  return d.fma(e.b.CreateFMul(y, s), p, e.b.CreateFMul(y, k));
}

// u = n + f, |f| <= 1/2;  2^u = 2^n (1 + f Q(f)). Saturates at 2^-1000 and 2^1000. A NaN that was a
// float stays one: n's bits are the last 12 of its payload, which are 0.
Value* exp2_of_double(Emitter& e, Value* u) {
  Doubles d(e);
  Value *low = float_constant(u, -1000.0), *high = float_constant(u, 1000.0);
  u = e.b.CreateSelect(e.b.CreateFCmpOGT(low, u), low, u);
  u = e.b.CreateSelect(e.b.CreateFCmpOLT(high, u), high, u);
  // The sum's last place is 1: it rounds u to n, which stands in its last bits.
  Value* shift = float_constant(u, 0x1.8p52);
  Value* sum = e.b.CreateFAdd(u, shift);
  Value* f = e.b.CreateFSub(u, e.b.CreateFSub(sum, shift));
  Value* p = d.polynomial(f, {1.0, 0x1.62e430af26ed2p-1, 0x1.ebfbdc3c2f68ep-3, 0x1.c6aee88eb6649p-5,
                              0x1.3b2d4cf251bbcp-7, 0x1.5f3e52e73118ap-10, 0x1.41fbbbc312428p-13});
  Value* bits = bits_as_integer(e, sum);
  Value* power = e.b.CreateShl(bits, int_constant(bits, 52));
  return bits_as_float(e, e.b.CreateAdd(bits_as_integer(e, p), power));
}

// |x|^y where 0 < |x| < infinity, NaN where y is.
Value* power_of_magnitude(Emitter& e, Value* size, Value* y) {
  auto* wide = with_lanes(e.b.getDoubleTy(), lanes_of(size));
  // Beyond 2^100 all is 0, 1 or infinite; infinity itself, times the 0 of log2(1), would be NaN.
  Value *low = float_constant(y, -0x1p100), *high = float_constant(y, 0x1p100);
  y = e.b.CreateSelect(e.b.CreateFCmpOGT(low, y), low, y);
  y = e.b.CreateSelect(e.b.CreateFCmpOLT(high, y), high, y);
  Value* u = times_log2(e, e.b.CreateFPExt(y, wide), e.b.CreateFPExt(size, wide));
  return e.b.CreateFPTrunc(exp2_of_double(e, u), size->getType());
}

// What depends on y alone; LLVM moves it out of loops that do not change y. The powers of 0,
// infinity and NaN.
struct Exponent {
  Value *is_integer, *is_odd, *of_zero, *of_infinity, *of_nan;
};

Exponent exponent(Emitter& e, Value* y) {
  const auto is_whole = [&](Value* number) {
    return e.b.CreateFCmpOEQ(e.b.CreateUnaryIntrinsic(llvm::Intrinsic::roundeven, number), number);
  };
  Value* is_integer = is_whole(y);
  Value* is_even = is_whole(e.b.CreateFMul(y, float_constant(y, 0.5)));
  Value *zero = float_constant(y, 0.0), *infinity = llvm::ConstantFP::getInfinity(y->getType());
  // What is neither below nor above 0: 1 at 0, else the NaN itself.
  Value* of_nan = e.b.CreateSelect(e.b.CreateFCmpOEQ(y, zero), float_constant(y, 1.0),
                                   llvm::ConstantFP::getNaN(y->getType()));
  const auto by_sign = [&](Value* below, Value* above) {
    return e.b.CreateSelect(e.b.CreateFCmpOLT(y, zero), below,
                            e.b.CreateSelect(e.b.CreateFCmpOGT(y, zero), above, of_nan));
  };
  return {is_integer, e.b.CreateAnd(is_integer, e.b.CreateNot(is_even)), by_sign(infinity, zero),
          by_sign(zero, infinity), of_nan};
}

// C99 Annex F, 9.4.4, in the order in which later lines overrule earlier ones.
Value* with_special_cases(Emitter& e, Value* x, Value* y, Value* size, Value* result) {
  const Exponent of_y = exponent(e, y);
  Value *zero = float_constant(x, 0.0), *one = float_constant(x, 1.0),
        *infinity = llvm::ConstantFP::getInfinity(x->getType());
  const auto choose = [&](Value* when, Value* then) {
    result = e.b.CreateSelect(when, then, result);
  };
  choose(e.b.CreateFCmpOEQ(size, zero), of_y.of_zero);
  choose(e.b.CreateFCmpOEQ(size, infinity), of_y.of_infinity);
  Value* sign = e.b.CreateAnd(bits_as_integer(e, x),
                              e.b.CreateSExt(of_y.is_odd, bits_as_integer(e, x)->getType()));
  sign = e.b.CreateAnd(sign, int_constant(sign, INT32_MIN));
  result = bits_as_float(e, e.b.CreateOr(bits_as_integer(e, result), sign));
  Value* is_root = e.b.CreateAnd(e.b.CreateFCmpOLT(x, zero), e.b.CreateNot(of_y.is_integer));
  choose(e.b.CreateAnd(is_root, e.b.CreateFCmpOLT(size, infinity)),
         llvm::ConstantFP::getNaN(x->getType()));
  choose(e.b.CreateFCmpUNO(x, zero), of_y.of_nan);
  return e.b.CreateSelect(e.b.CreateFCmpOEQ(x, one), one, result);
}

Value* piece_of_pow(Emitter& e, Value* x, Value* y) {
  const Contraction contraction(e, false);
  Value* size = e.b.CreateUnaryIntrinsic(llvm::Intrinsic::fabs, x);
  return with_special_cases(e, x, y, size, power_of_magnitude(e, size, y));
}

}  // namespace

// In pieces of two registers of floats, four of doubles: steps of four chains stand side by side,
// overlap in time and share the loads of coefficients. One register's chain is as long as what a
// processor looks ahead, so that chains of different pieces would hardly meet.
Value* float_pow(Emitter& e, Value* x, Value* y) {
  const int lanes = lanes_of(x), most = std::max(4, e.machine.vector_bits / 16);
  if (lanes <= most) return piece_of_pow(e, x, y);
  std::vector<Value*> pieces;
  for (int start = 0; start < lanes; start += most) {
    const int count = std::min(most, lanes - start);
    pieces.push_back(piece_of_pow(e, slice(e, x, start, count), slice(e, y, start, count)));
  }
  return concat(e, pieces);
}

}  // namespace retrograde::codegen
