// Calls: operators whose arguments are not simply evaluated, and C functions.
#include "codegen/function_generator.h"
#include "diagnostics/error.h"
#include "ir/build.h"
#include "ir/random.h"
#include "retrograde_runtime.h"

namespace retrograde::codegen {

using namespace ir;

Value* FunctionGenerator::make(const Call& e) {
  switch (e.call_type) {
    case CallType::Operator:
      return operator_call(e);
    case CallType::Extern:
      return extern_call(e);
    default:
      internal_error("call of " + quoted(e.name) +
                     " reached code generation: lowering replaces it by loads");
  }
}

static std::vector<Type> types_of(const std::vector<Expr>& args) {
  std::vector<Type> types;
  for (const Expr& arg : args) types.push_back(arg.type());
  return types;
}

Value* FunctionGenerator::operator_call(const Call& e) {
  switch (e.op) {
    case Op::likely:
    case Op::likely_if_innermost:
    case Op::promise_clamped:
    case Op::unsafe_promise_clamped:
    case Op::stop_gradient:
    case Op::memoize_tag:
      return value(e.args[0]);
    case Op::strict_float: {
      const Contraction off(e_, false);
      const MemoScope scope(*this, false);  // values that may be contracted stay outside
      return value(e.args[0]);
    }
    case Op::undef:
      return llvm::Constant::getNullValue(llvm_type(e_, e.type));
    case Op::print:
    case Op::print_when:
      return print_call(e);
    case Op::require:
      return require(e);
    case Op::random:
      return random(e);
    case Op::if_then_else:
      return branch_value(e.args[0], e.args[1], e.args[2]);
    case Op::error:
      return report_error(value(e.args[0]), e.args, 1, "");
    case Op::runtime_call:
      return runtime_call(e);
    case Op::pack:
      return pack(e.args);
    case Op::prefetch:
      return prefetch(e);
    case Op::trace:
      return trace(e);
    case Op::address_of: {
      const auto* load = e.args[0].as<Load>();
      RETROGRADE_ASSERT(load != nullptr, "address of something that is no load");
      return element_pointer(storage(load->name), load->type.element_of(), index64(load->index));
    }
    default:
      break;
  }
  if (is_buffer_operator(e.op)) return buffer_operator(e);
  std::vector<Value*> args;
  for (const Expr& arg : e.args) args.push_back(value(arg));
  if (is_math_operator(e.op)) return math_operator(e_, e.op, e.type, args);
  if (is_fast_operator(e.op)) return fast_operator(e_, e.op, e.type, args);
  Value* result = simple_operator(e_, e.op, e.type, types_of(e.args), args);
  RETROGRADE_ASSERT(result != nullptr, "no code for operator ", op_info(e.op).name);
  return result;
}

// Lane by lane: the C function knows no vectors.
Value* FunctionGenerator::extern_call(const Call& e) {
  std::vector<Value*> args;
  std::vector<llvm::Type*> params;
  for (const Expr& arg : e.args) {
    args.push_back(value(arg));
    params.push_back(llvm_type(e_, arg.type().element_of()));
  }
  auto* type = llvm::FunctionType::get(llvm_type(e_, e.type.element_of()), params, false);
  auto callee = e_.module.getOrInsertFunction(e.name, type);
  std::vector<Value*> lanes;
  for (int i = 0; i < e.type.lanes(); i++) {
    std::vector<Value*> lane_args;
    for (Value* arg : args) lane_args.push_back(lane(e_, arg, i));
    lanes.push_back(b_.CreateCall(callee, lane_args));
  }
  return from_lanes(e_, lanes);
}

Value* FunctionGenerator::branch_value(const Expr& condition, const Expr& then_value,
                                       const Expr& else_value) {
  Value* test = value(condition);
  if (test->getType()->isVectorTy()) {
    Value *a = value(then_value), *b = value(else_value);
    return b_.CreateSelect(test, a, b);
  }
  return chosen(
      test, [&] { return value(then_value); }, [&] { return value(else_value); });
}

// (condition, value, message...). All lanes must hold.
Value* FunctionGenerator::require(const Call& e) {
  Value* condition = value(e.args[0]);
  if (condition->getType()->isVectorTy()) condition = b_.CreateAndReduce(condition);
  fail_unless(condition, [&] {
    const auto* error = e.args.size() == 3 ? e.args[2].as<Call>() : nullptr;
    if (error && error->is_op(Op::error)) return value(e.args[2]);  // lowering's, with its own code
    return report_error(b_.getInt32(static_cast<uint32_t>(retrograde_error_requirement_failed)),
                        e.args, 2, " ");
  });
  return value(e.args[1]);
}

// ir/random.h in vectors.
Value* FunctionGenerator::random(const Call& e) {
  const Type word = UInt(32, e.type.lanes());
  llvm::Type* type = llvm_type(e_, word);
  const auto constant = [&](uint32_t number) { return llvm::ConstantInt::get(type, number); };
  const auto xor_shifted = [&](Value* v, uint32_t bits) {
    return b_.CreateXor(v, b_.CreateLShr(v, constant(bits)));
  };
  Value* state = constant(random_seed);
  for (const Expr& arg : e.args) {
    RETROGRADE_ASSERT(arg.type().is_int_or_uint(), "seed of type ", to_string(arg.type()));
    Value* seed = convert(e_, UInt(32, arg.type().lanes()), arg.type(), value(arg));
    if (lanes_of(seed) != word.lanes()) seed = splat(e_, seed, word.lanes());
    state = b_.CreateAdd(b_.CreateXor(state, seed), constant(random_seed));
    state = b_.CreateMul(xor_shifted(state, 16), constant(random_multiplier_1));
    state = b_.CreateMul(xor_shifted(state, 15), constant(random_multiplier_2));
    state = xor_shifted(state, 15);
  }
  if (!e.type.is_float()) {
    RETROGRADE_ASSERT(e.type.bits() <= 32, "random number of type ", to_string(e.type));
    return b_.CreateTrunc(state, llvm_type(e_, e.type));
  }
  const Type single = Float(32, e.type.lanes());
  Value* number = convert(e_, single, word, b_.CreateLShr(state, constant(8)));
  return convert(e_, e.type, single, b_.CreateFMul(number, float_constant(number, 0x1p-24)));
}

}  // namespace retrograde::codegen
