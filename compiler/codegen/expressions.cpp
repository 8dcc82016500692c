// Every expression kind. A node that several expressions share gets one value.
#include <algorithm>

#include "codegen/function_generator.h"
#include "diagnostics/error.h"
#include "ir/build.h"
#include "ir/print.h"
#include "ir/visit.h"

namespace retrograde::codegen {

using namespace ir;

Value* FunctionGenerator::known(Memo MemoFrame::*memo, const Expr& e) const {
  const std::vector<MemoFrame>& frames = frame_.memo;
  for (size_t i = frames.size(); i-- > 0;) {
    const auto found = (frames[i].*memo).find(e.get());
    if (found != (frames[i].*memo).end()) return found->second.value;
    if (!frames[i].sees_outer) break;
  }
  return nullptr;
}

Value* FunctionGenerator::remembered(Memo MemoFrame::*memo, const Expr& e,
                                     Value* (FunctionGenerator::*make)(const Expr&)) {
  if (Value* value = known(memo, e)) return value;
  Value* result = (this->*make)(e);
  if (e.kind() != Kind::Variable) (frame_.memo.back().*memo)[e.get()] = {e, result};
  return result;
}

Value* FunctionGenerator::value(const Expr& e) {
  return remembered(&MemoFrame::values, e, &FunctionGenerator::make_value);
}

Value* FunctionGenerator::value_alone(const Expr& e) {
  const MemoScope scope(*this, false);
  return value(e);
}

Value* FunctionGenerator::make_value(const Expr& e) {
  return match(
      e, [&](const Variable& v) { return make(v); },
      [&](const Cast& c) { return convert(e_, c.type, c.value.type(), value(c.value)); },
      [&](const Reinterpret& r) { return reinterpret(e_, r.type, r.value.type(), value(r.value)); },
      [&](const Binary& node) {
        if (Value* sum = sum_of_products(e)) return sum;
        if (Value* sum = sum_with_strong_product(node)) return sum;
        Value *a = value(node.a), *b = value(node.b);
        return binary(e_, node.kind, node.a.type(), a, b);
      },
      [&](const Not& n) { return b_.CreateNot(value(n.a)); },
      [&](const Select& s) { return make(s); }, [&](const Load& l) { return make(l); },
      [&](const Ramp& r) { return make(r); },
      [&](const Broadcast& s) { return repeat(e_, value(s.value), s.lanes); },
      [&](const Call& c) { return make(c); }, [&](const Let& l) { return make(l); },
      [&](const Shuffle& s) { return make(s); }, [&](const VectorReduce& r) { return make(r); },
      [&](const ExprNode&) { return make_immediate(e); });
}

Value* FunctionGenerator::make_immediate(const Expr& e) {
  llvm::Type* type = llvm_type(e_, e.type());
  if (const auto* imm = e.as<IntImm>())
    return llvm::ConstantInt::get(type, static_cast<uint64_t>(imm->value), true);
  if (const auto* imm = e.as<UIntImm>()) return llvm::ConstantInt::get(type, imm->value);
  if (const auto* imm = e.as<StringImm>()) return string_constant(imm->value);
  const auto* imm = e.as<FloatImm>();
  RETROGRADE_ASSERT(imm != nullptr, "no code for ", kind_name(e.kind()));
  if (!is_half(e.type())) return llvm::ConstantFP::get(type, imm->value);
  const uint16_t bits =
      e.type().is_bfloat() ? bfloat16_t(imm->value).to_bits() : float16_t(imm->value).to_bits();
  return llvm::ConstantInt::get(type, bits);
}

Value* FunctionGenerator::string_constant(const std::string& text) {
  Value*& constant = strings_[text];
  if (!constant) constant = b_.CreateGlobalString(text, "text");
  return constant;
}

Value* FunctionGenerator::make(const Variable& e) {
  const auto found = frame_.variables.find(e.name);
  RETROGRADE_ASSERT(found != frame_.variables.end(), "no value for variable ", quoted(e.name),
                    " in ", source_.name);
  return found->second;
}

void FunctionGenerator::bind_let(const std::string& name, const Expr& bound) {
  Value* v = value(bound);
  const bool is_sum =
      bound.type() == Int(32) && (bound.as<Add>() || bound.as<Sub>() || bound.as<Mul>());
  Value* wide = is_sum ? index64(bound) : nullptr;
  if (v->getName().empty() && !llvm::isa<llvm::Constant>(v)) v->setName(name);
  if (bound.type().is_vector() && bound.type().is_int()) {
    if (const Coordinate at = coordinate(bound); at.is_plain) frame_.coordinates[name] = at;
    bind_ramp(name, bound);
  }
  frame_.variables[name] = v;
  frame_.indices.erase(name);
  if (wide) frame_.indices[name] = wide;
}

// Accesses see through the name.
void FunctionGenerator::bind_ramp(const std::string& name, const Expr& bound) {
  frame_.ramps.erase(name);
  const auto linear = as_linear(bound);
  if (!linear) return;
  const std::string first = name + ".lane0";
  bind_let(first, linear->base);
  frame_.ramps[name] = {variable(first, linear->base.type()), linear->stride};
}

// The names of lets are unique, so a binding may stay when its body ends. Only copies of a let
// (unrolled code) bind a name anew within a statement; nodes that the bodies share must then not be
// looked up.
bool FunctionGenerator::rebinds(const std::string& name, const Expr& bound) const {
  for (size_t i = frame_.memo.size(); i-- > 0;) {
    const auto found = frame_.memo[i].lets.find(name);
    if (found != frame_.memo[i].lets.end()) return found->second != bound.get();
    if (!frame_.memo[i].sees_outer) break;
  }
  return false;
}

Value* FunctionGenerator::make(const Let& e) {
  const bool is_copy = rebinds(e.name, e.value);
  bind_let(e.name, e.value);
  if (!is_copy) {
    // No scope: what the body computes is straight-line code, and stays good after it.
    frame_.memo.back().lets[e.name] = e.value.get();
    return value(e.body);
  }
  const MemoScope scope(*this, false);
  frame_.memo.back().lets[e.name] = e.value.get();
  return value(e.body);
}

// base + stride * k for k in [0, lanes), each a vector when base is one.
Value* FunctionGenerator::make(const Ramp& e) {
  const Type element = e.base.type().element_of();
  const int inner = e.base.type().lanes();
  Value* base = repeat(e_, value(e.base), e.lanes);
  Value* stride = repeat(e_, value(e.stride), e.lanes);
  Value* steps;
  if (inner == 1) {
    steps = iota(e_, is_half(element) ? b_.getInt32Ty() : llvm_type(e_, element), e.lanes);
  } else {
    std::vector<Value*> numbers;
    for (int k = 0; k < e.lanes; k++) {
      numbers.push_back(splat(e_, lane(e_, iota(e_, b_.getInt32Ty(), e.lanes), k), inner));
    }
    steps =
        convert(e_, is_half(element) ? Int(32, e.type.lanes()) : element.with_lanes(e.type.lanes()),
                Int(32, e.type.lanes()), concat(e_, numbers));
  }
  if (is_half(element)) steps = convert(e_, e.type, Int(32, e.type.lanes()), steps);
  return binary(e_, Kind::Add, e.type, base, binary(e_, Kind::Mul, e.type, stride, steps));
}

// Lane i of the result is lane i / k of the i % k-th of k vectors.
static bool is_interleave(const Shuffle& e) {
  const int count = static_cast<int>(e.vectors.size()), lanes = e.vectors[0].type().lanes();
  if (count < 2 || static_cast<int>(e.indices.size()) != count * lanes) return false;
  for (const Expr& vector : e.vectors) {
    if (vector.type().lanes() != lanes) return false;
  }
  for (int i = 0; i < count * lanes; i++) {
    if (e.indices[static_cast<size_t>(i)] != i % count * lanes + i / count) return false;
  }
  return true;
}

Value* FunctionGenerator::make(const Shuffle& e) {
  std::vector<Value*> vectors;
  for (const Expr& vector : e.vectors) vectors.push_back(value(vector));
  if (is_interleave(e)) return interleave(e_, vectors);
  // Vectors of one width give a shuffle of LLVM's each, put over those before; others are put
  // together first.
  const bool is_uniform = std::all_of(e.vectors.begin(), e.vectors.end(), [&](const Expr& vector) {
    return vector.type() == e.vectors[0].type();
  });
  if (is_uniform && (vectors.size() == 2 || e.type.lanes() == e.vectors[0].type().lanes()))
    return pick_lanes(e_, vectors, e.indices);
  Value* all = concat(e_, vectors);
  return e.indices.size() == 1 ? lane(e_, all, e.indices[0]) : shuffle(e_, all, all, e.indices);
}

Value* FunctionGenerator::make(const VectorReduce& e) {
  const Type element = e.type.element_of();
  return reduce_groups(e_, reduced_in_part(e), e.type.lanes(), [&](Value* a, Value* b) {
    return binary(e_, e.op, element.with_lanes(lanes_of(a)), a, b);
  });
}

// ---- indices ----

Value* FunctionGenerator::index64(const Expr& e) {
  return remembered(&MemoFrame::indices, e, &FunctionGenerator::make_index64);
}

Value* FunctionGenerator::make_index64(const Expr& e) {
  const Type type = e.type();
  RETROGRADE_ASSERT(type.is_scalar() && type.is_int_or_uint(), "index of type ", to_string(type));
  if (type == Int(32)) {
    if (const auto* variable = e.as<Variable>()) {
      const auto found = frame_.indices.find(variable->name);
      if (found != frame_.indices.end()) return found->second;
    }
    if (const auto* sum = e.as<Add>()) return b_.CreateAdd(index64(sum->a), index64(sum->b));
    if (const auto* difference = e.as<Sub>())
      return b_.CreateSub(index64(difference->a), index64(difference->b));
    if (const auto* product = e.as<Mul>())
      return b_.CreateMul(index64(product->a), index64(product->b));
    const auto* call = e.as<Call>();
    if (call && call->call_type == CallType::Operator && op_info(call->op).cls == OpClass::Marker) {
      return index64(call->args[0]);
    }
  }
  return b_.CreateIntCast(value(e), b_.getInt64Ty(), type.is_int());
}

}  // namespace retrograde::codegen
