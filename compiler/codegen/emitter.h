// The state that all parts of the code generator share (module, builder, machine), and helpers that map types and
// operators of our IR to LLVM values. Nothing here depends on expressions of our IR.
//
// A value of type T with n lanes is an LLVM vector <n x t>, or t itself if n is 1:
//   bool i1 (a byte in memory), intN and uintN iN, float32 float, float64 double, handle ptr,
//   float16 and bfloat16 i16: their bit patterns; arithmetic widens to float and rounds back.
#pragma once

#include <llvm/IR/IRBuilder.h>
#include <llvm/IR/Module.h>

#include <functional>
#include <vector>

#include "codegen/llvm/machine.h"
#include "ir/expr.h"

namespace retrograde::codegen {

using llvm::Value;

struct Emitter {
  llvm::Module& module;
  const Machine& machine;
  llvm::IRBuilder<> b;
  Emitter(llvm::Module& module, const Machine& machine)
      : module(module), machine(machine), b(module.getContext()) {}
  llvm::LLVMContext& context() { return module.getContext(); }
};

// Allows or forbids fusing multiplications and additions to FMA during its lifetime.
class Contraction {
 public:
  Contraction(Emitter& e, bool allowed) : guard_(e.b) {
    llvm::FastMathFlags flags;
    flags.setAllowContract(allowed);
    e.b.setFastMathFlags(flags);
  }

 private:
  llvm::IRBuilderBase::FastMathFlagGuard guard_;
};

// ---- types.cpp ----
// All functions of a module get the same target attributes: LLVM builds a new subtarget for each combination.
void set_target(Emitter& e, llvm::Function* function);
llvm::Type* llvm_type(Emitter& e, Type type);
llvm::Type* memory_type(Emitter& e, Type type);  // of a scalar: bool is a byte
llvm::Type* with_lanes(llvm::Type* scalar, int lanes);
int lanes_of(const Value* value);
Value* int_constant(Value* like, int64_t value);   // of the (vector) integer type of `like`
Value* float_constant(Value* like, double value);  // of the (vector) float type of `like`
Value* float_constant(llvm::Type* type, double value);
Value* bits_as_float(Emitter& e, Value* integer);  // i32 to float, i64 to double, lanes kept
Value* bits_as_integer(Emitter& e, Value* number);
bool is_half(Type type);  // float16 or bfloat16
Value* from_memory(Emitter& e, Type type, Value* value);
Value* to_memory(Emitter& e, Type type, Value* value);

// ---- vectors.cpp ----
Value* splat(Emitter& e, Value* scalar, int lanes);  // the scalar itself when lanes is 1
// Whether any lane of a mask is set; a scalar mask is returned unchanged.
Value* any_lane(Emitter& e, Value* mask);
Value* iota(Emitter& e, llvm::Type* scalar, int lanes);  // 0, 1, 2 ... of an integer or float type
Value* slice(Emitter& e, Value* vector, int start, int lanes);  // past the end: any value
Value* concat(Emitter& e, std::vector<Value*> parts);
Value* interleave(Emitter& e, const std::vector<Value*>& vectors);  // a0 b0 ... a1 b1 ...
// Picks lanes from the concatenation of vectors of one width; more than two if the result has that width too.
Value* pick_lanes(Emitter& e, const std::vector<Value*>& vectors, const std::vector<int>& indices);
Value* repeat(Emitter& e, Value* vector, int times);
Value* reverse(Emitter& e, Value* vector);
Value* lane(Emitter& e, Value* vector, int index);  // a scalar
Value* from_lanes(Emitter& e, const std::vector<Value*>& scalars);
Value* shuffle(Emitter& e, Value* a, Value* b, const std::vector<int>& indices);
using Combine = std::function<Value*(Value*, Value*)>;
// Combines groups of neighbouring lanes until `lanes` are left. The order is fixed, but not left to right.
Value* reduce_groups(Emitter& e, Value* vector, int lanes, const Combine& combine);

// ---- division.cpp: integers, remainder never negative; x / 0 == x % 0 == 0 ----
Value* divide(Emitter& e, Type type, Value* a, Value* b);
Value* modulo(Emitter& e, Type type, Value* a, Value* b);

// ---- half.cpp ----
Value* half_to_float(Emitter& e, Type half, Value* bits);
Value* float_to_half(Emitter& e, Type half, Value* number);   // to nearest even; number: float
Value* double_to_half(Emitter& e, Type half, Value* number);  // rounds once; number: double

// ---- fused_sums.cpp: floats of at least 32 bits ----
Value* add_floats(Emitter& e, Value* a, Value* b);
Value* subtract_floats(Emitter& e, Value* a, Value* b);
// Takes the right to fuse from all operations: what is to fuse has fused.
void keep_sums_as_they_are(llvm::Module& module);

// ---- arithmetic.cpp ----
// Operands have type `type`; comparisons give i1 lanes. And and Or take only bool.
Value* binary(Emitter& e, ir::Kind kind, Type type, Value* a, Value* b);
Value* convert(Emitter& e, Type to, Type from, Value* value);             // Cast
Value* convert_saturating(Emitter& e, Type to, Type from, Value* value);  // saturating_cast
Value* reinterpret(Emitter& e, Type to, Type from, Value* value);
// Lane i is a[2i] b[2i] + a[2i + 1] b[2i + 1] as int32; a and b are vectors of int16. Only on x86.
Value* add_products_in_pairs(Emitter& e, Value* a, Value* b);
// Every pure operator that is not in math_table.h: floor, abs, shift_left ... Null for other operators. `types` and
// `args` have one entry per argument.
Value* simple_operator(Emitter& e, ir::Op op, Type result, const std::vector<Type>& types,
                       const std::vector<Value*>& args);

// ---- math.cpp, float_pow.cpp, float_functions.cpp, fast_math.cpp ----
bool is_math_operator(ir::Op op);
Value* math_operator(Emitter& e, ir::Op op, Type type, const std::vector<Value*>& args);
Value* float_pow(Emitter& e, Value* x, Value* y);  // float32, inlined
// Functions of float32 that are inlined for this machine.
bool is_inlined_for_floats(const Machine& machine, ir::Op op);
Value* float_function(Emitter& e, ir::Op op, Value* x);
bool is_fast_operator(ir::Op op);
Value* fast_operator(Emitter& e, ir::Op op, Type type, const std::vector<Value*>& args);

}  // namespace retrograde::codegen
