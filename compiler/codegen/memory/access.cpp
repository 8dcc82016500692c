#include "codegen/memory/access.h"

#include <bit>

#include "ir/build.h"
#include "ir/visit.h"

namespace retrograde::codegen {

using namespace ir;

// ---- indices ----

std::optional<LinearIndex> as_linear(const Frame& frame, const Expr& index) {
  if (const auto* ramp = index.as<Ramp>()) {
    const auto stride = as_const_int(ramp->stride);
    if (!stride) return std::nullopt;
    if (ramp->base.type().is_scalar()) return LinearIndex{ramp->base, *stride};
    const auto inner = as_linear(frame, ramp->base);
    // A ramp of ramps is one ramp if each inner ramp continues where the previous one ends.
    const bool goes_on = inner && inner->stride * ramp->base.type().lanes() == *stride;
    return goes_on ? inner : std::nullopt;
  }
  if (const auto* splat = index.as<Broadcast>()) {
    if (splat->value.type().is_scalar()) return LinearIndex{splat->value, 0};
    return std::nullopt;
  }
  if (const auto* name = index.as<Variable>()) {
    const auto found = frame.ramps.find(name->name);
    return found == frame.ramps.end() ? std::nullopt : std::optional(found->second);
  }
  if (const auto* call = index.as<Call>()) {
    const bool is_marker =
        call->call_type == CallType::Operator && op_info(call->op).cls == OpClass::Marker;
    return is_marker ? as_linear(frame, call->args[0]) : std::nullopt;
  }
  const bool is_ring =
      index.kind() == Kind::Add || index.kind() == Kind::Sub || index.kind() == Kind::Mul;
  if (!is_ring) return std::nullopt;
  const auto* node = index.as<Binary>();
  const auto a = as_linear(frame, node->a), b = a ? as_linear(frame, node->b) : std::nullopt;
  if (!b) return std::nullopt;
  const Expr base = binary(index.kind(), a->base, b->base);
  if (index.kind() == Kind::Add) return LinearIndex{base, a->stride + b->stride};
  if (index.kind() == Kind::Sub) return LinearIndex{base, a->stride - b->stride};
  const auto factor = as_const_int(a->stride == 0 ? a->base : b->base);
  if (a->stride == 0 && b->stride == 0) return LinearIndex{base, 0};
  if (!factor || (a->stride != 0 && b->stride != 0)) return std::nullopt;
  return LinearIndex{base, *factor * (a->stride == 0 ? b->stride : a->stride)};
}

const Ramp* as_scalar_ramp(const Expr& index) {
  const auto* ramp = index.as<Ramp>();
  return ramp && ramp->base.type().is_scalar() ? ramp : nullptr;
}

std::vector<Expr> pieces_of(const Expr& index) {
  const auto* ramp = index.as<Ramp>();
  if (!ramp || ramp->base.type().is_scalar()) return {};
  std::vector<Expr> pieces;
  for (int k = 0; k < ramp->lanes; k++) {
    const Expr offset = binary(Kind::Mul, ramp->stride, make_const(ramp->stride.type(), k));
    const auto constant = as_const_int(offset);
    const auto* inner = ramp->base.as<Ramp>();
    if (constant && inner && inner->base.type().is_scalar()) {  // keeps the piece a ramp
      const Expr base = binary(Kind::Add, inner->base, make_const(inner->base.type(), *constant));
      pieces.push_back(make_ramp(base, inner->stride, inner->lanes));
    } else {
      pieces.push_back(binary(Kind::Add, ramp->base, offset));
    }
  }
  return pieces;
}

// Whether the index is a coordinate clamped to an image's bounds and free of data-dependent values. Loop partitioning
// leaves such indices to border iterations, which run rarely.
Coordinate coordinate_of(const Frame& frame, const Expr& index) {
  Coordinate result{true, false, index};
  walk(index, [&](const Expr& e) {
    if (e.type().is_scalar() || !result.is_plain) return false;
    const auto* name = e.as<Variable>();
    const auto known = name ? frame.coordinates.find(name->name) : frame.coordinates.end();
    if (known != frame.coordinates.end()) {
      result.is_clamped |= known->second.is_clamped;
      return false;
    }
    const bool is_bound = e.kind() == Kind::Min || e.kind() == Kind::Max;
    const bool is_sum = e.kind() == Kind::Add || e.kind() == Kind::Sub || e.kind() == Kind::Mul;
    const bool is_leaf = e.kind() == Kind::Ramp || e.kind() == Kind::Broadcast;
    result.is_clamped |= is_bound;
    result.is_plain = is_bound || is_sum || is_leaf;
    return !is_leaf;
  });
  return result;
}

// ---- addresses ----

Value* element_pointer(Emitter& e, const Storage& from, Type type, Value* index) {
  return e.b.CreateGEP(memory_type(e, type), from.base, index);
}

Value* lane_index(Emitter& e, Value* first, Value* stride, int lane) {
  return e.b.CreateAdd(first, e.b.CreateMul(stride, e.b.getInt64(static_cast<uint64_t>(lane))));
}

llvm::Align alignment_of(Type type) { return llvm::Align(static_cast<uint64_t>(type.bytes())); }

uint64_t access_bytes(Type type) {
  return static_cast<uint64_t>(type.bytes()) * static_cast<uint64_t>(type.lanes());
}

// Private memory is excluded: taking its address would keep its vectors out of registers.
bool can_be_one_access(const Emitter& e, const Storage& storage, Type type) {
  return e.machine.is_device() && !storage.is_private && !type.is_scalar() &&
         std::has_single_bit(access_bytes(type)) &&
         access_bytes(type) * 8 <= static_cast<uint64_t>(e.machine.vector_bits);
}

Value* is_aligned(FunctionContext& c, Value* pointer, Type type) {
  llvm::Type* number = c.e.module.getDataLayout().getIntPtrType(pointer->getType());
  Value* rest = c.b.CreateAnd(c.b.CreatePtrToInt(pointer, number),
                              llvm::ConstantInt::get(number, access_bytes(type) - 1));
  return c.b.CreateIsNull(rest);
}

// Number of lanes in one register. Wider vectors are loaded and stored register by register: LLVM keeps an array in
// registers only if its loads are as wide as its stores. Otherwise it splits whole vectors as one integer of thousands
// of bits.
int native_lanes(const Machine& machine, Type type) {
  return std::max(1, machine.vector_bits / 8 / type.bytes());
}

}  // namespace retrograde::codegen
