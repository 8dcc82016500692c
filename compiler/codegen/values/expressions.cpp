// Code for every expression kind. A node that several expressions share is evaluated once.
#include <algorithm>

#include "codegen/memory/access.h"
#include "codegen/values/calls.h"
#include "diagnostics/error.h"
#include "ir/build.h"
#include "ir/print.h"
#include "ir/visit.h"

namespace retrograde::codegen {

using namespace ir;

Value* Values::known(Memo MemoFrame::*memo, const Expr& e) const {
  const std::vector<MemoFrame>& frames = c.frame.memo;
  for (size_t i = frames.size(); i-- > 0;) {
    const auto found = (frames[i].*memo).find(e.get());
    if (found != (frames[i].*memo).end()) return found->second.value;
    if (!frames[i].sees_outer) break;
  }
  return nullptr;
}

Value* Values::memoised(Memo MemoFrame::*memo, const Expr& e, Value* (Values::*make)(const Expr&)) {
  if (Value* value = known(memo, e)) return value;
  Value* result = (this->*make)(e);
  if (e.kind() != Kind::Variable) (c.frame.memo.back().*memo)[e.get()] = {e, result};
  return result;
}

Value* Values::of(const Expr& e) { return memoised(&MemoFrame::values, e, &Values::make_value); }

Value* Values::alone(const Expr& e) {
  const MemoScope scope(c.frame, false);
  return of(e);
}

Value* Values::predicate(const Expr& predicate) {
  return !predicate.defined() || is_const_true(predicate) ? nullptr : of(predicate);
}

Value* Values::make_value(const Expr& e) {
  return match(
      e, [&](const Variable& v) { return make(v); },
      [&](const Cast& to) { return convert(c.e, to.type, to.value.type(), of(to.value)); },
      [&](const Reinterpret& r) { return reinterpret(c.e, r.type, r.value.type(), of(r.value)); },
      [&](const Binary& node) {
        if (Value* sum = sum_of_products(*this, e)) return sum;
        if (Value* sum = sum_with_strong_product(*this, node)) return sum;
        Value *a = of(node.a), *b = of(node.b);
        return binary(c.e, node.kind, node.a.type(), a, b);
      },
      [&](const Not& n) { return c.b.CreateNot(of(n.a)); },
      [&](const Select& s) { return selected(*this, s); },
      [&](const Load& l) { return load(*this, l); }, [&](const Ramp& r) { return make(r); },
      [&](const Broadcast& s) { return repeat(c.e, of(s.value), s.lanes); },
      [&](const Call& call) { return called(*this, call); }, [&](const Let& l) { return make(l); },
      [&](const Shuffle& s) { return make(s); }, [&](const VectorReduce& r) { return make(r); },
      [&](const ExprNode&) { return make_immediate(e); });
}

Value* Values::make_immediate(const Expr& e) {
  llvm::Type* type = llvm_type(c.e, e.type());
  if (const auto* imm = e.as<IntImm>())
    return llvm::ConstantInt::get(type, static_cast<uint64_t>(imm->value), true);
  if (const auto* imm = e.as<UIntImm>()) return llvm::ConstantInt::get(type, imm->value);
  if (const auto* imm = e.as<StringImm>()) return c.string_constant(imm->value);
  const auto* imm = e.as<FloatImm>();
  RETROGRADE_ASSERT(imm != nullptr, "no code for ", kind_name(e.kind()));
  if (!is_half(e.type())) return llvm::ConstantFP::get(type, imm->value);
  const uint16_t bits =
      e.type().is_bfloat() ? bfloat16_t(imm->value).to_bits() : float16_t(imm->value).to_bits();
  return llvm::ConstantInt::get(type, bits);
}

Value* Values::make(const Variable& e) {
  const auto found = c.frame.variables.find(e.name);
  RETROGRADE_ASSERT(found != c.frame.variables.end(), "no value for variable ", quoted(e.name),
                    " in ", c.function_name);
  return found->second;
}

void Values::bind(const std::string& name, const Expr& bound) {
  Value* v = of(bound);
  const bool is_sum =
      bound.type() == Int(32) && (bound.as<Add>() || bound.as<Sub>() || bound.as<Mul>());
  Value* wide = is_sum ? index64(bound) : nullptr;
  if (v->getName().empty() && !llvm::isa<llvm::Constant>(v)) v->setName(name);
  if (bound.type().is_vector() && bound.type().is_int()) {
    if (const Coordinate at = coordinate_of(c.frame, bound); at.is_plain)
      c.frame.coordinates[name] = at;
    bind_ramp(name, bound);
  }
  c.frame.variables[name] = v;
  c.frame.indices.erase(name);
  if (wide) c.frame.indices[name] = wide;
}

// Lets accesses recognise the bound ramp through its name.
void Values::bind_ramp(const std::string& name, const Expr& bound) {
  c.frame.ramps.erase(name);
  const auto linear = as_linear(c.frame, bound);
  if (!linear) return;
  const std::string first = name + ".lane0";
  bind(first, linear->base);
  c.frame.ramps[name] = {variable(first, linear->base.type()), linear->stride};
}

// Names of lets are unique, so a binding may outlive its body. Only copies of a let (unrolled code) rebind a name
// within a statement; then the memo must not be used for nodes that the bodies share.
bool Values::rebinds(const std::string& name, const Expr& bound) const {
  for (size_t i = c.frame.memo.size(); i-- > 0;) {
    const auto found = c.frame.memo[i].lets.find(name);
    if (found != c.frame.memo[i].lets.end()) return found->second != bound.get();
    if (!c.frame.memo[i].sees_outer) break;
  }
  return false;
}

Value* Values::make(const Let& e) {
  const bool is_copy = rebinds(e.name, e.value);
  bind(e.name, e.value);
  if (!is_copy) {
    // No scope: the body is straight-line code, so its values stay valid after it.
    c.frame.memo.back().lets[e.name] = e.value.get();
    return of(e.body);
  }
  const MemoScope scope(c.frame, false);
  c.frame.memo.back().lets[e.name] = e.value.get();
  return of(e.body);
}

// base + stride * k for k in [0, lanes); each is a vector if base is one.
Value* Values::make(const Ramp& e) {
  const Type element = e.base.type().element_of();
  const int inner = e.base.type().lanes();
  Value* base = repeat(c.e, of(e.base), e.lanes);
  Value* stride = repeat(c.e, of(e.stride), e.lanes);
  Value* steps;
  if (inner == 1) {
    steps = iota(c.e, is_half(element) ? c.b.getInt32Ty() : llvm_type(c.e, element), e.lanes);
  } else {
    std::vector<Value*> numbers;
    for (int k = 0; k < e.lanes; k++) {
      numbers.push_back(splat(c.e, lane(c.e, iota(c.e, c.b.getInt32Ty(), e.lanes), k), inner));
    }
    steps = convert(c.e,
                    is_half(element) ? Int(32, e.type.lanes()) : element.with_lanes(e.type.lanes()),
                    Int(32, e.type.lanes()), concat(c.e, numbers));
  }
  if (is_half(element)) steps = convert(c.e, e.type, Int(32, e.type.lanes()), steps);
  return binary(c.e, Kind::Add, e.type, base, binary(c.e, Kind::Mul, e.type, stride, steps));
}

// Whether lane i of the result is lane i / k of vector i % k, with k vectors.
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

Value* Values::make(const Shuffle& e) {
  std::vector<Value*> vectors;
  for (const Expr& vector : e.vectors) vectors.push_back(of(vector));
  if (is_interleave(e)) return interleave(c.e, vectors);
  // Vectors of one width are combined by successive LLVM shuffles. Vectors of different widths are concatenated first.
  const bool is_uniform = std::all_of(e.vectors.begin(), e.vectors.end(), [&](const Expr& vector) {
    return vector.type() == e.vectors[0].type();
  });
  if (is_uniform && (vectors.size() == 2 || e.type.lanes() == e.vectors[0].type().lanes()))
    return pick_lanes(c.e, vectors, e.indices);
  Value* all = concat(c.e, vectors);
  return e.indices.size() == 1 ? lane(c.e, all, e.indices[0]) : shuffle(c.e, all, all, e.indices);
}

Value* Values::make(const VectorReduce& e) {
  const Type element = e.type.element_of();
  if (e.type.is_bool() && e.type.is_scalar() && e.op == Kind::Or) return any_lane(c.e, of(e.value));
  if (e.type.is_bool() && e.type.is_scalar() && e.op == Kind::And)
    return c.b.CreateNot(any_lane(c.e, c.b.CreateNot(of(e.value))));
  return reduce_groups(c.e, partly_reduced(*this, e), e.type.lanes(), [&](Value* a, Value* b) {
    return binary(c.e, e.op, element.with_lanes(lanes_of(a)), a, b);
  });
}

// ---- indices ----

Value* Values::index64(const Expr& e) {
  return memoised(&MemoFrame::indices, e, &Values::make_index64);
}

Value* Values::make_index64(const Expr& e) {
  const Type type = e.type();
  RETROGRADE_ASSERT(type.is_scalar() && type.is_int_or_uint(), "index of type ", to_string(type));
  if (type == Int(32)) {
    if (const auto* variable = e.as<Variable>()) {
      const auto found = c.frame.indices.find(variable->name);
      if (found != c.frame.indices.end()) return found->second;
    }
    if (const auto* sum = e.as<Add>()) return c.b.CreateAdd(index64(sum->a), index64(sum->b));
    if (const auto* difference = e.as<Sub>())
      return c.b.CreateSub(index64(difference->a), index64(difference->b));
    if (const auto* product = e.as<Mul>()) {
      // Factors are 32-bit coordinates and strides; a device multiplies two of them into 64 bits with one instruction.
      const auto factor = [&](const Expr& f) {
        return c.e.machine.is_device() ? c.b.CreateSExt(of(f), c.b.getInt64Ty()) : index64(f);
      };
      return c.b.CreateMul(factor(product->a), factor(product->b));
    }
    const auto* call = e.as<Call>();
    if (call && call->call_type == CallType::Operator && op_info(call->op).cls == OpClass::Marker) {
      return index64(call->args[0]);
    }
  }
  return c.b.CreateIntCast(of(e), c.b.getInt64Ty(), type.is_int());
}

Value* Values::index_vector(const Expr& e) {
  const Type type = e.type();
  return type.is_uint() ? convert(c.e, Int(64, type.lanes()), type, of(e)) : of(e);
}

}  // namespace retrograde::codegen
