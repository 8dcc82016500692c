// Calls of C functions, and of operators that do not simply evaluate their arguments.
#include "codegen/values/calls.h"

#include "codegen/memory/access.h"
#include "diagnostics/error.h"
#include "ir/build.h"
#include "ir/random.h"
#include "retrograde_runtime.h"

namespace retrograde::codegen {

using namespace ir;

// Calls the C function once for each lane, because it takes scalars.
static Value* extern_call(Values& values, const Call& e) {
  FunctionContext& c = values.c;
  std::vector<Value*> args;
  std::vector<llvm::Type*> params;
  for (const Expr& arg : e.args) {
    args.push_back(values.of(arg));
    params.push_back(llvm_type(c.e, arg.type().element_of()));
  }
  auto* type = llvm::FunctionType::get(llvm_type(c.e, e.type.element_of()), params, false);
  auto callee = c.e.module.getOrInsertFunction(e.name, type);
  std::vector<Value*> lanes;
  for (int i = 0; i < e.type.lanes(); i++) {
    std::vector<Value*> lane_args;
    for (Value* arg : args) lane_args.push_back(lane(c.e, arg, i));
    lanes.push_back(c.b.CreateCall(callee, lane_args));
  }
  return from_lanes(c.e, lanes);
}

static Value* branch_value(Values& values, const Expr& condition, const Expr& then_value,
                           const Expr& else_value) {
  FunctionContext& c = values.c;
  Value* test = values.of(condition);
  if (test->getType()->isVectorTy()) {
    Value *a = values.of(then_value), *b = values.of(else_value);
    return c.b.CreateSelect(test, a, b);
  }
  return c.chosen(
      test, [&] { return values.of(then_value); }, [&] { return values.of(else_value); });
}

// Arguments: (condition, value, message...). The condition must hold in all lanes.
static Value* require(Values& values, const Call& e) {
  FunctionContext& c = values.c;
  Value* condition = values.of(e.args[0]);
  if (condition->getType()->isVectorTy()) condition = c.b.CreateAndReduce(condition);
  c.fail_unless(condition, [&] {
    const auto* error = e.args.size() == 3 ? e.args[2].as<Call>() : nullptr;
    if (error && error->is_op(Op::error))
      return values.of(e.args[2]);  // lowering's own error call, which has its own code
    return report_error(values,
                        c.b.getInt32(static_cast<uint32_t>(retrograde_error_requirement_failed)),
                        e.args, 2, " ");
  });
  return values.of(e.args[1]);
}

// The generator of ir/random.h, in vectors.
static Value* random(Values& values, const Call& e) {
  FunctionContext& c = values.c;
  const Type word = UInt(32, e.type.lanes());
  llvm::Type* type = llvm_type(c.e, word);
  const auto constant = [&](uint32_t number) { return llvm::ConstantInt::get(type, number); };
  const auto xor_shifted = [&](Value* v, uint32_t bits) {
    return c.b.CreateXor(v, c.b.CreateLShr(v, constant(bits)));
  };
  Value* state = constant(random_seed);
  for (const Expr& arg : e.args) {
    RETROGRADE_ASSERT(arg.type().is_int_or_uint(), "seed of type ", to_string(arg.type()));
    Value* seed = convert(c.e, UInt(32, arg.type().lanes()), arg.type(), values.of(arg));
    if (lanes_of(seed) != word.lanes()) seed = splat(c.e, seed, word.lanes());
    state = c.b.CreateAdd(c.b.CreateXor(state, seed), constant(random_seed));
    state = c.b.CreateMul(xor_shifted(state, 16), constant(random_multiplier_1));
    state = c.b.CreateMul(xor_shifted(state, 15), constant(random_multiplier_2));
    state = xor_shifted(state, 15);
  }
  if (!e.type.is_float()) {
    RETROGRADE_ASSERT(e.type.bits() <= 32, "random number of type ", to_string(e.type));
    return c.b.CreateTrunc(state, llvm_type(c.e, e.type));
  }
  const Type single = Float(32, e.type.lanes());
  Value* number = convert(c.e, single, word, c.b.CreateLShr(state, constant(8)));
  return convert(c.e, e.type, single, c.b.CreateFMul(number, float_constant(number, 0x1p-24)));
}

static Value* operator_call(Values& values, const Call& e) {
  FunctionContext& c = values.c;
  switch (e.op) {
    case Op::likely:
    case Op::likely_if_innermost:
    case Op::promise_clamped:
    case Op::unsafe_promise_clamped:
    case Op::stop_gradient:
    case Op::memoize_tag:
      return values.of(e.args[0]);
    case Op::strict_float: {
      const Contraction off(c.e, false);
      const MemoScope scope(
          c.frame, false);  // code that may contract must not share values with code that may not
      return values.of(e.args[0]);
    }
    case Op::undef:
      return llvm::Constant::getNullValue(llvm_type(c.e, e.type));
    case Op::print:
    case Op::print_when:
      return print_call(values, e);
    case Op::require:
      return require(values, e);
    case Op::random:
      return random(values, e);
    case Op::if_then_else:
      return branch_value(values, e.args[0], e.args[1], e.args[2]);
    case Op::error:
      return report_error(values, values.of(e.args[0]), e.args, 1, "");
    case Op::runtime_call:
      return runtime_call(values, e);
    case Op::pack:
      return pack(values, e.args);
    case Op::prefetch:
      return prefetch(values, e);
    case Op::trace:
      return trace(values, e);
    case Op::address_of: {
      const auto* load = e.args[0].as<Load>();
      RETROGRADE_ASSERT(load != nullptr, "address of something that is no load");
      return element_pointer(c.e, c.storage(load->name), load->type.element_of(),
                             values.index64(load->index));
    }
    default:
      break;
  }
  if (is_buffer_operator(e.op)) return buffer_operator(values, e);
  const auto args = mapped(e.args, [&](const Expr& arg) { return values.of(arg); });
  if (is_math_operator(e.op)) return math_operator(c.e, e.op, e.type, args);
  if (is_fast_operator(e.op)) return fast_operator(c.e, e.op, e.type, args);
  Value* result = simple_operator(c.e, e.op, e.type, mapped(e.args, &Expr::type), args);
  RETROGRADE_ASSERT(result != nullptr, "no code for operator ", op_info(e.op).name);
  return result;
}

Value* called(Values& values, const Call& e) {
  switch (e.call_type) {
    case CallType::Operator:
      return operator_call(values, e);
    case CallType::Extern:
      return extern_call(values, e);
    default:
      internal_error("call of " + quoted(e.name) +
                     " reached code generation: lowering replaces it by loads");
  }
}

}  // namespace retrograde::codegen
