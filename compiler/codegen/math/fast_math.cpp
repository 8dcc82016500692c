// The fast_ functions of float32, inlined: range reduction and a polynomial. math_table.h lists their errors.
//
// The polynomials have minimal maximum relative error (cos: absolute) over the reduced range. They are fitted by
// Lawson's iteratively reweighted least squares, with the leading Taylor terms fixed. Their own errors are below 4e-9;
// the errors in the table come from float32 rounding. log uses the odd series of log((1 + s) / (1 - s)), |s| <= 0.172.
#include <llvm/IR/Intrinsics.h>

#include <algorithm>

#include "codegen/emitter.h"
#include "codegen/math/math_table.h"

namespace retrograde::codegen {
namespace {

using ir::Op;
using Args = std::vector<Value*>;

// Float vector arithmetic with constants, so that code reads like the formulas.
struct Formula {
  Emitter& e;
  llvm::Type* type;

  Value* constant(double value) { return float_constant(type, value); }
  Value* mul(Value* a, Value* b) { return e.b.CreateFMul(a, b); }
  Value* mul(Value* a, double b) { return mul(a, constant(b)); }
  Value* add(Value* a, Value* b) { return e.b.CreateFAdd(a, b); }
  Value* add(Value* a, double b) { return add(a, constant(b)); }
  Value* sub(Value* a, Value* b) { return e.b.CreateFSub(a, b); }
  Value* nearest(Value* a) { return e.b.CreateUnaryIntrinsic(llvm::Intrinsic::roundeven, a); }
  Value* less(Value* a, double b) { return e.b.CreateFCmpOLT(a, constant(b)); }
  Value* greater(Value* a, double b) { return e.b.CreateFCmpOGT(a, constant(b)); }
  Value* select(Value* condition, Value* a, Value* b) { return e.b.CreateSelect(condition, a, b); }
  Value* to_int(Value* a) {
    const int lanes = lanes_of(a);
    return convert(e, Int(32, lanes), Float(32, lanes), a);
  }
  Value* to_float(Value* a) { return e.b.CreateSIToFP(a, type); }
  // c[0] + c[1] x + ..., by Horner's rule.
  Value* polynomial(Value* x, const std::vector<double>& c) {
    Value* result = constant(c.back());
    for (size_t i = c.size() - 1; i-- > 0;) result = add(mul(result, x), c[i]);
    return result;
  }
};

// ln2 split in two (Cody and Waite 1980, "Software manual for the elementary functions", chapter 6). The first part has
// 16 bits, so its products with exponents are exact.
constexpr double ln2_high = 0x1.62e4p-1, ln2_low = 1.42860682030941723e-6;

// x = n ln2 + r, |r| <= ln2 / 2;  exp(x) = 2^n exp(r).
Value* fast_exp(Emitter& e, Value* x) {
  Formula f{e, x->getType()};
  x = f.select(f.less(x, -87.0), f.constant(-87.0), x);
  x = f.select(f.greater(x, 88.0), f.constant(88.0), x);
  Value* n = f.nearest(f.mul(x, 1.44269504088896341));
  Value* r = f.sub(f.sub(x, f.mul(n, ln2_high)), f.mul(n, ln2_low));
  Value* p = f.polynomial(r, {1.0, 1.0, 0.499999934032, 0.166665199712, 0.0416683958391,
                              0.00836879689272, 1.38144311046e-3});
  Value* power = e.b.CreateShl(f.to_int(n), int_constant(f.to_int(n), 23));
  Value* bits = e.b.CreateAdd(bits_as_integer(e, p), power);
  // For a NaN, n is arbitrary; its bits must not produce a finite result.
  return f.select(e.b.CreateFCmpUNO(x, x), x, bits_as_float(e, bits));
}

// x = 2^k m, m in [sqrt(1/2), sqrt(2));  log(x) = k ln2 + 2 atanh(s), s = (m - 1) / (m + 1).
Value* fast_log(Emitter& e, Value* x) {
  Formula f{e, x->getType()};
  Value* bits = bits_as_integer(e, x);
  const auto integer = [&](int64_t value) { return int_constant(bits, value); };
  constexpr int64_t sqrt_half = 0x3f3504f3;
  Value* k = e.b.CreateAShr(e.b.CreateSub(bits, integer(sqrt_half)), integer(23));
  Value* m = bits_as_float(e, e.b.CreateSub(bits, e.b.CreateShl(k, integer(23))));
  Value *s = e.b.CreateFDiv(f.add(m, -1.0), f.add(m, 1.0)), *z = f.mul(s, s);
  Value* tail = f.polynomial(z, {0.666667765285, 0.399775214985, 0.298723141381});
  Value* log_m = f.add(f.add(s, s), f.mul(f.mul(s, z), tail));
  Value* scale = f.to_float(k);
  Value* result = f.add(f.mul(scale, ln2_high), f.add(log_m, f.mul(scale, ln2_low)));
  Value* infinity = llvm::ConstantFP::getInfinity(f.type);
  result = f.select(f.less(x, 0x1p-126), llvm::ConstantFP::getInfinity(f.type, true), result);
  result = f.select(f.less(x, 0.0), llvm::ConstantFP::getNaN(f.type), result);
  // Infinity and NaN return x itself.
  return f.select(e.b.CreateFCmpULT(x, infinity), f.select(e.b.CreateFCmpUNO(x, x), x, result), x);
}

Value* fast_pow(Emitter& e, Value* x, Value* y) {
  Formula f{e, x->getType()};
  Value* result = fast_exp(e, f.mul(y, fast_log(e, x)));
  Value *is_zero = e.b.CreateFCmpOEQ(x, f.constant(0.0)),
        *y_is_zero = e.b.CreateFCmpOEQ(y, f.constant(0.0));
  Value* at_zero = f.select(f.less(y, 0.0), llvm::ConstantFP::getInfinity(f.type), f.constant(0.0));
  return f.select(y_is_zero, f.constant(1.0), f.select(is_zero, at_zero, result));
}

// x = q pi/2 + r, |r| <= pi/4; the quadrant q selects sin(r) or cos(r), and the sign.
Value* fast_sin_cos(Emitter& e, Value* x, bool is_cos) {
  Formula f{e, x->getType()};
  Value* n = f.nearest(f.mul(x, 0.63661977236758134308));
  // pi/2 split in three (Cody and Waite 1980, chapter 8); products with the first two parts are exact for |n| < 2^13.
  // These two are twice those of pi/4 in S. Moshier's Cephes (sinf.c).
  Value* r = f.sub(x, f.mul(n, 1.5703125));
  r = f.sub(r, f.mul(n, 4.837512969970703125e-4));
  r = f.sub(r, f.mul(n, 7.549789948768648e-8));
  Value* z = f.mul(r, r);
  Value* sine = f.add(
      r,
      f.mul(f.mul(r, z), f.polynomial(z, {-0.166666545415, 8.33215637424e-3, -1.95146763727e-4})));
  Value* cosine =
      f.polynomial(z, {1.0, -0.5, 0.0416666467556, -1.38873618535e-3, 2.44377782771e-5});
  Value* q = f.to_int(n);
  if (is_cos) q = e.b.CreateAdd(q, int_constant(q, 1));
  Value* is_odd = e.b.CreateICmpNE(e.b.CreateAnd(q, int_constant(q, 1)), int_constant(q, 0));
  Value* result = f.select(is_odd, cosine, sine);
  Value* sign = e.b.CreateShl(e.b.CreateAnd(q, int_constant(q, 2)), int_constant(q, 30));
  return bits_as_float(e, e.b.CreateXor(bits_as_integer(e, result), sign));
}

Value* fast_inverse(Emitter& e, Value* x) { return e.b.CreateFDiv(float_constant(x, 1.0), x); }

// A first guess from the exponent, with the constant of C. Lomont (2003, "Fast inverse square root"), then three Newton
// steps y (1.5 - x y^2 / 2). Processors' own estimates differ between vendors; this is the same everywhere.
Value* fast_inverse_sqrt(Emitter& e, Value* x) {
  Formula f{e, x->getType()};
  Value* bits = bits_as_integer(e, x);
  Value* guess =
      e.b.CreateSub(int_constant(bits, 0x5f375a86), e.b.CreateLShr(bits, int_constant(bits, 1)));
  Value *y = bits_as_float(e, guess), *half = f.mul(x, -0.5);
  for (int step = 0; step < 3; step++) y = f.mul(y, f.add(f.mul(f.mul(half, y), y), 1.5));
  Value* infinity = llvm::ConstantFP::getInfinity(f.type);
  y = f.select(f.less(x, 0x1p-126), infinity, y);
  y = f.select(e.b.CreateFCmpOEQ(x, infinity), f.constant(0.0), y);
  return f.select(e.b.CreateFCmpULT(x, f.constant(0.0)), llvm::ConstantFP::getNaN(f.type), y);
}

Value* fast_float32(Emitter& e, Op op, const Args& args) {
  switch (op) {
    case Op::fast_exp:
      return fast_exp(e, args[0]);
    case Op::fast_log:
      return fast_log(e, args[0]);
    case Op::fast_pow:
      return fast_pow(e, args[0], args[1]);
    case Op::fast_sin:
      return fast_sin_cos(e, args[0], false);
    case Op::fast_cos:
      return fast_sin_cos(e, args[0], true);
    case Op::fast_inverse:
      return fast_inverse(e, args[0]);
    default:
      return fast_inverse_sqrt(e, args[0]);
  }
}

Value* full_float64(Emitter& e, Op op, Type type, const Args& args) {
  if (const Op exact = ir::exact_form(op); exact != op) return math_operator(e, exact, type, args);
  if (op == Op::fast_inverse) return fast_inverse(e, args[0]);
  return fast_inverse(e, e.b.CreateUnaryIntrinsic(llvm::Intrinsic::sqrt, args[0]));
}

}  // namespace

bool is_fast_operator(Op op) {
  return std::any_of(std::begin(fast_functions), std::end(fast_functions),
                     [&](const FastFunction& function) { return function.op == op; });
}

Value* fast_operator(Emitter& e, Op op, Type type, const Args& args) {
  if (type.bits() == 64) return full_float64(e, op, type, args);
  if (!is_half(type)) return fast_float32(e, op, args);
  Args wide;
  for (Value* arg : args) wide.push_back(half_to_float(e, type, arg));
  return float_to_half(e, type, fast_float32(e, op, wide));
}

}  // namespace retrograde::codegen
