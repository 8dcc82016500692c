// Calls of vector math functions. Vectors are split into the widths that SLEEF has; the last piece is padded.
#include <llvm/IR/Intrinsics.h>

#include <algorithm>

#include "codegen/device/device_math.h"
#include "codegen/emitter.h"
#include "codegen/math/constant_math.h"
#include "codegen/math/math_table.h"
#include "diagnostics/error.h"

namespace retrograde::codegen {
namespace {

using ir::Op;
using Args = std::vector<Value*>;

const MathFunction* find_math_function(Op op) {
  const auto* found = std::find_if(std::begin(math_functions), std::end(math_functions),
                                   [&](const MathFunction& function) { return function.op == op; });
  return found == std::end(math_functions) ? nullptr : found;
}

// Declares a function that depends only on its arguments, so that LLVM may move, merge and delete its calls.
llvm::FunctionCallee declare_pure(Emitter& e, const std::string& name, llvm::Type* type,
                                  size_t arity) {
  const std::vector<llvm::Type*> params(arity, type);
  auto callee = e.module.getOrInsertFunction(name, llvm::FunctionType::get(type, params, false));
  auto* function = llvm::cast<llvm::Function>(callee.getCallee());
  function->setDoesNotAccessMemory();
  function->setDoesNotThrow();
  function->setWillReturn();
  return callee;
}

// The narrowest width that holds `lanes`, or the widest available.
int call_lanes(const Machine& machine, int bits, int lanes) {
  if (lanes == 1 || !machine.has_sleef) return 1;
  int width = machine.min_math_lanes(bits);
  while (width < lanes && width < machine.max_math_lanes(bits)) width *= 2;
  return width;
}

// `lanes` lanes, beginning at `start`. Lanes past the end repeat the first one, so that padding never takes a slow
// path.
Value* padded_slice(Emitter& e, Value* vector, int start, int lanes) {
  const int has = lanes_of(vector);
  if (start + lanes <= has || has == 1)
    return has == 1 ? splat(e, vector, lanes) : slice(e, vector, start, lanes);
  std::vector<int> indices;
  for (int i = start; i < start + lanes; i++) indices.push_back(i < has ? i : start);
  return shuffle(e, vector, vector, indices);
}

// Applies one function to all lanes of float or double vectors.
Value* call_by_pieces(Emitter& e, const MathFunction& function, const Args& args) {
  if (Value* known = constant_result(e, function, args)) return known;
  const int total = lanes_of(args[0]);
  auto* scalar = args[0]->getType()->getScalarType();
  const int bits = static_cast<int>(scalar->getPrimitiveSizeInBits());
  Args pieces;
  for (int start = 0; start < total;) {
    const int lanes = call_lanes(e.machine, bits, total - start),
              useful = std::min(lanes, total - start);
    Args piece_args;
    for (Value* arg : args) piece_args.push_back(padded_slice(e, arg, start, lanes));
    const std::string name =
        e.machine.is_device()
            ? device_math_symbol(function.stem, bits, static_cast<int>(args.size()))
            : e.machine.math_symbol(function.stem, function.precision, bits, lanes);
    Value* piece =
        e.b.CreateCall(declare_pure(e, name, with_lanes(scalar, lanes), args.size()), piece_args);
    pieces.push_back(slice(e, piece, 0, useful));
    start += useful;
  }
  return concat(e, pieces);
}

Value* full_precision(Emitter& e, Op op, const Args& args) {
  return call_by_pieces(e, *find_math_function(op), args);
}

Value* copy_sign(Emitter& e, Value* size, Value* sign) {
  return e.b.CreateBinaryIntrinsic(llvm::Intrinsic::copysign, size, sign);
}

// sinh and cosh for x whose exp(x) overflows although half of it may not.
Value* near_overflow(Emitter& e, Op op, Value* x, Value* size) {
  Value* root = full_precision(e, Op::exp, {e.b.CreateFMul(size, float_constant(x, 0.5))});
  Value* result = e.b.CreateFMul(e.b.CreateFMul(root, float_constant(x, 0.5)), root);
  return op == Op::sinh ? copy_sign(e, result, x) : result;
}

// asinh and acosh for x whose square overflows.
Value* logarithmic(Emitter& e, Op op, Value* x, Value* size) {
  Value* result =
      e.b.CreateFAdd(full_precision(e, Op::log, {size}), float_constant(x, 0.69314718055994530942));
  return op == Op::asinh ? copy_sign(e, result, x) : result;
}

Value* with_limit(Emitter& e, const MathFunction& function, Value* x, Value* inside, double limit) {
  Value* size = e.b.CreateUnaryIntrinsic(llvm::Intrinsic::fabs, x);
  const bool is_exponential = function.op == Op::sinh || function.op == Op::cosh;
  // For acosh the sign counts: it is undefined for large negative numbers.
  Value* is_far = e.b.CreateFCmpOGT(function.op == Op::acosh ? x : size, float_constant(x, limit));
  Value* outside = is_exponential ? near_overflow(e, function.op, x, size)
                                  : logarithmic(e, function.op, x, size);
  return e.b.CreateSelect(is_far, outside, inside);
}

// ---- on devices, whose libclc functions need some corrections ----

// If exp(x) is a denormal, libclc's float32 version gives 0. So compute exp(x + 64) exp(-64), in which the sum is
// exact.
Value* device_exp(Emitter& e, const MathFunction& function, Value* x) {
  constexpr double least = -0x1.5d589ep+6, distance = 64, rest = 0x1.969d47321e4ccp-93;
  Value* is_small = e.b.CreateFCmpOLT(x, float_constant(x, least));
  Value* moved = e.b.CreateFAdd(x, float_constant(x, distance));
  Value* result = call_by_pieces(e, function, {e.b.CreateSelect(is_small, moved, x)});
  return e.b.CreateSelect(is_small, e.b.CreateFMul(result, float_constant(x, rest)), result);
}

// libclc's float64 versions index their tables out of bounds for large x, even if the result is then discarded. So
// large x never reach them.
Value* device_sinh_cosh(Emitter& e, const MathFunction& function, Value* x) {
  Value* size = e.b.CreateUnaryIntrinsic(llvm::Intrinsic::fabs, x);
  Value* is_near =
      e.b.CreateFCmpOLE(size, float_constant(x, function.float64_limit));  // false for NaN
  Value* near = e.b.CreateSelect(is_near, x, float_constant(x, 0.0));
  return e.b.CreateSelect(is_near, call_by_pieces(e, function, {near}),
                          near_overflow(e, function.op, x, size));
}

Value* on_device(Emitter& e, const MathFunction& function, int bits, const Args& args) {
  if (function.op == Op::exp && bits == 32) return device_exp(e, function, args[0]);
  const bool looks_beyond = function.op == Op::sinh || function.op == Op::cosh;
  if (looks_beyond && bits == 64) return device_sinh_cosh(e, function, args[0]);
  return call_by_pieces(e, function, args);
}

}  // namespace

bool is_math_operator(Op op) { return find_math_function(op) != nullptr; }

Value* math_operator(Emitter& e, Op op, Type type, const Args& args) {
  if (is_half(type)) {
    Args wide;
    for (Value* arg : args) wide.push_back(half_to_float(e, type, arg));
    return float_to_half(e, type, math_operator(e, op, Float(32, type.lanes()), wide));
  }
  if (op == Op::pow && type.bits() == 32) return float_pow(e, args[0], args[1]);
  if (type.bits() == 32 && is_inlined_for_floats(e.machine, op))
    return float_function(e, op, args[0]);
  const MathFunction& function = *find_math_function(op);
  if (e.machine.is_device()) return on_device(e, function, type.bits(), args);
  Value* result = call_by_pieces(e, function, args);
  const double limit = type.bits() == 32 ? function.float32_limit : function.float64_limit;
  return limit == 0 ? result : with_limit(e, function, args[0], result, limit);
}

}  // namespace retrograde::codegen
