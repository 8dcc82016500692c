// pow of float32, inlined. log2, product and exp2 are in double and rounded once at the end, so the error is that of
// the two polynomials (below 3e-9) plus half a unit in the last place. Doubles hold 2^u for every u whose power float32
// can tell from infinity or 0, so no second scaling is needed. No case takes a branch: branches would keep LLVM from
// hoisting what depends only on y out of loops.
//
// Method: W. J. Cody and W. Waite, Software Manual for the Elementary Functions (1980), chapters 5 to 7, without their
// tables; polynomials of minimal maximum relative error (Remez).
// Rejected: log2 as a sum of two floats, which takes about as many instructions and needs FMA for its accuracy.
#include <llvm/Analysis/VectorUtils.h>
#include <llvm/IR/Intrinsics.h>

#include <algorithm>

#include "codegen/emitter.h"

namespace retrograde::codegen {
namespace {

// Arithmetic whose bits are the same in every vector width: FMA is emitted explicitly where available, and nothing else
// may fuse.
class Doubles {
 public:
  explicit Doubles(Emitter& e) : e_(e), contraction_(e, false) {}
  Value* fma(Value* a, Value* b, Value* c) {
    if (!e_.machine.has_fma()) return e_.b.CreateFAdd(e_.b.CreateFMul(a, b), c);
    return e_.b.CreateIntrinsic(llvm::Intrinsic::fma, {a->getType()}, {a, b, c});
  }
  // c[0] + c[1] x + ..., an odd number of terms, by Horner's rule over pairs: its dependency chain is half as long as
  // over single terms. Rejected: two such rules in parallel, one step shorter for one more multiplication; 4 % slower
  // where multipliers are the bottleneck.
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

// x = 2^k m, m in [sqrt(1/2), sqrt(2)), for finite x > 0, which is not denormal as a double. For x = 0, k is -1023 and
// m is 1.
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
  // Puts the biased exponent into the low bits of 2^52: AVX2 has no conversion of 64-bit integers.
  Value* biased = e.b.CreateOr(e.b.CreateLShr(moved, integer(52)), integer(two_to_52));
  return {e.b.CreateFSub(bits_as_float(e, biased), float_constant(x, 0x1p52 + 1023)),
          bits_as_float(e, e.b.CreateAdd(mantissa, integer(sqrt_half)))};
}

// y log2(x) = y k + y s P(s^2), s = (m - 1) / (m + 1), |s| <= 0.172; it is 0 only for x = 1.
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

// u = n + f, |f| <= 1/2;  2^u = 2^n (1 + f Q(f)), for |u| < 1022; otherwise an arbitrary number. A NaN converted from
// float stays NaN: n's bits are the last 12 of its payload, which are 0.
Value* exp2_of_double(Emitter& e, Value* u) {
  Doubles d(e);
  // The sum's last place has value 1, so the addition rounds u to n, which is in the low bits.
  Value *shift = float_constant(u, 0x1.8p52), *sum = e.b.CreateFAdd(u, shift);
  Value* n = e.machine.has_rounding() ? e.b.CreateUnaryIntrinsic(llvm::Intrinsic::roundeven, u)
                                      : e.b.CreateFSub(sum, shift);
  Value* f = e.b.CreateFSub(u, n);
  Value* p = d.polynomial(f, {1.0, 0x1.62e430af26ed2p-1, 0x1.ebfbdc3c2f68ep-3, 0x1.c6aee88eb6649p-5,
                              0x1.3b2d4cf251bbcp-7, 0x1.5f3e52e73118ap-10, 0x1.41fbbbc312428p-13});
  Value* bits = bits_as_integer(e, sum);
  Value* power = e.b.CreateShl(bits, int_constant(bits, 52));
  return bits_as_float(e, e.b.CreateAdd(bits_as_integer(e, p), power));
}

// The bounds on |x| between which a power is computed. A smaller |x| has the power of 0, a larger one that of infinity.
struct Ends {
  Value *low, *high;
};

constexpr int64_t least_float = 1, largest_float = 0x7f7fffff;  // as bits

// About 2^-t and 2^t, t = 400 / |y|: their bits are t 2^23 away from those of 1. In log2(x) that is t to 1.45 t upward
// and 0.7 t to t downward. So |y log2(x)| is below 600 inside the bounds and above 280 outside, unless the range of
// float32 ends first; there |y| is below 4.
Ends ends_of(Emitter& e, Value* y) {
  constexpr int64_t one = 0x3f800000;
  Value* most = float_constant(y, 0x1p30);
  Value* t = e.b.CreateFDiv(float_constant(y, 400 * 0x1p23),
                            e.b.CreateUnaryIntrinsic(llvm::Intrinsic::fabs, y));
  t = e.b.CreateSelect(e.b.CreateFCmpOLT(t, most), t, most);
  Value* steps = e.b.CreateFPToSI(t, with_lanes(e.b.getInt32Ty(), lanes_of(y)));
  const auto end = [&](llvm::Intrinsic::ID side, Value* bits, int64_t last) {
    return bits_as_float(e, e.b.CreateBinaryIntrinsic(side, bits, int_constant(bits, last)));
  };
  Value* bits = int_constant(steps, one);
  return {end(llvm::Intrinsic::smax, e.b.CreateSub(bits, steps), least_float),
          end(llvm::Intrinsic::smin, e.b.CreateAdd(bits, steps), largest_float)};
}

// The powers of 0, infinity and NaN. They depend only on y, so LLVM hoists them out of loops in which y is invariant.
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
  // The value if y is neither below nor above 0: 1 for y = 0, else the NaN itself.
  Value* of_nan = e.b.CreateSelect(e.b.CreateFCmpOEQ(y, zero), float_constant(y, 1.0),
                                   llvm::ConstantFP::getNaN(y->getType()));
  const auto by_sign = [&](Value* below, Value* above) {
    return e.b.CreateSelect(e.b.CreateFCmpOLT(y, zero), below,
                            e.b.CreateSelect(e.b.CreateFCmpOGT(y, zero), above, of_nan));
  };
  return {is_integer, e.b.CreateAnd(is_integer, e.b.CreateNot(is_even)), by_sign(infinity, zero),
          by_sign(zero, infinity), of_nan};
}

// C99 Annex F, 9.4.4, in an order in which later lines override earlier ones. The case x = 1, whose powers are all 1,
// is handled elsewhere.
Value* with_special_cases(Emitter& e, Value* x, Value* y, Value* size, const Ends& ends,
                          Value* result) {
  const Exponent of_y = exponent(e, y);
  Value *zero = float_constant(x, 0.0), *infinity = llvm::ConstantFP::getInfinity(x->getType());
  const auto choose = [&](Value* when, Value* then) {
    result = e.b.CreateSelect(when, then, result);
  };
  choose(e.b.CreateFCmpOLT(size, ends.low), of_y.of_zero);
  choose(e.b.CreateFCmpOGT(size, ends.high), of_y.of_infinity);
  Value* sign = e.b.CreateAnd(bits_as_integer(e, x),
                              e.b.CreateSExt(of_y.is_odd, bits_as_integer(e, x)->getType()));
  sign = e.b.CreateAnd(sign, int_constant(sign, INT32_MIN));
  result = bits_as_float(e, e.b.CreateOr(bits_as_integer(e, result), sign));
  Value* is_root = e.b.CreateAnd(e.b.CreateFCmpOLT(x, zero), e.b.CreateNot(of_y.is_integer));
  choose(e.b.CreateAnd(is_root, e.b.CreateFCmpOLT(size, infinity)),
         llvm::ConstantFP::getNaN(x->getType()));
  choose(e.b.CreateFCmpUNO(x, zero), of_y.of_nan);
  return result;
}

// Clamp for |y|: beyond 2^100 all powers are 0, 1 or infinite. An infinite y times log2(1) = 0 would be NaN.
constexpr double large_exponent = 0x1p100;

// y log2(size) in double.
Value* y_log2(Emitter& e, Value* y, Value* size) {
  auto* wide = with_lanes(e.b.getDoubleTy(), lanes_of(size));
  return times_log2(e, e.b.CreateFPExt(y, wide), e.b.CreateFPExt(size, wide));
}

// Clamps to [-most, most]; NaN stays NaN.
Value* clamped(Emitter& e, Value* value, double most) {
  Value *low = float_constant(value, -most), *high = float_constant(value, most);
  value = e.b.CreateSelect(e.b.CreateFCmpOGT(low, value), low, value);
  return e.b.CreateSelect(e.b.CreateFCmpOLT(high, value), high, value);
}

// log2(1) is 0, so every power of 1 is 1 without a special case. This includes y = NaN, which becomes so large that
// both bounds are 1.
Value* pow_of_any(Emitter& e, Value* x, Value* y, Value* size) {
  Value *low = float_constant(y, -large_exponent), *high = float_constant(y, large_exponent);
  Value* finite = e.b.CreateSelect(e.b.CreateFCmpOGT(y, low), y, low);
  finite = e.b.CreateSelect(e.b.CreateFCmpOLT(finite, high), finite, high);
  Value* power = e.b.CreateFPTrunc(exp2_of_double(e, y_log2(e, finite, size)), y->getType());
  return with_special_cases(e, x, y, size, ends_of(e, finite), power);
}

// The same bits, for one x and many y: computing the bounds would cost more than clamping y log2(x).
Value* pow_of_uniform(Emitter& e, Value* x, Value* y, Value* size) {
  Value* u = clamped(e, y_log2(e, clamped(e, y, large_exponent), size), 1000.0);
  Value* power = e.b.CreateFPTrunc(exp2_of_double(e, u), y->getType());
  const auto float_of = [&](int64_t bits) {
    return bits_as_float(e, int_constant(bits_as_integer(e, x), bits));
  };
  power =
      with_special_cases(e, x, y, size, {float_of(least_float), float_of(largest_float)}, power);
  Value* one = float_constant(x, 1.0);
  return e.b.CreateSelect(e.b.CreateFCmpOEQ(x, one), one, power);
}

bool is_uniform(const Value* value) {
  return llvm::isa<llvm::Constant>(value) || llvm::getSplatValue(value) != nullptr;
}

}  // namespace

// Vectors are split into pieces of two float registers, i.e. four double registers. The four dependency chains
// interleave, overlap in time, and share loads of coefficients. With one register per piece, one chain fills the
// processor's instruction window, so chains of different pieces would hardly overlap.
Value* float_pow(Emitter& e, Value* x, Value* y) {
  const Contraction contraction(e, false);
  const int lanes = lanes_of(x), most = std::max(4, e.machine.vector_bits / 16);
  const auto pow = is_uniform(x) && !is_uniform(y) ? pow_of_uniform : pow_of_any;
  Value* size = e.b.CreateUnaryIntrinsic(llvm::Intrinsic::fabs, x);
  if (lanes <= most) return pow(e, x, y, size);
  std::vector<Value*> pieces;
  for (int start = 0; start < lanes; start += most) {
    const auto piece = [&](Value* all) {
      return slice(e, all, start, std::min(most, lanes - start));
    };
    pieces.push_back(pow(e, piece(x), piece(y), piece(size)));
  }
  return concat(e, pieces);
}

}  // namespace retrograde::codegen
