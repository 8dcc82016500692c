// Loads and stores. An index vector is one of
//
//   dense       base + i                  a vector load or store; base - i: the same, reversed
//   strided     base + s i, 2 <= |s| <= 4 loads: the vectors that cover the lanes, and shuffles
//   apart       base + s i                scalars at equal distances, s any scalar
//   pieces      a ramp of vectors         each piece on its own
//   broadcast   base                      one scalar
//   arbitrary                             gather or scatter where the machine has it, else scalars
//
// No access touches memory outside of the span from its lowest to its highest lane, and lanes whose
// predicate is off touch none but that of lanes whose predicate is on.
#include <bit>
#include <cstdlib>

#include "codegen/cut_loops.h"
#include "codegen/function_generator.h"
#include "diagnostics/error.h"
#include "ir/build.h"
#include "ir/visit.h"

namespace retrograde::codegen {

using namespace ir;

// Fewer lanes are not worth a loop.
constexpr int min_loop_lanes = 8;

FunctionGenerator::Storage& FunctionGenerator::storage(const std::string& name) {
  const auto found = frame_.storages.find(name);
  RETROGRADE_ASSERT(found != frame_.storages.end(), "no memory named ", quoted(name), " in ",
                    source_.name);
  return found->second;
}

// ---- indices ----

std::optional<FunctionGenerator::LinearIndex> FunctionGenerator::as_linear(const Expr& index) {
  if (const auto* ramp = index.as<Ramp>()) {
    const auto stride = as_const_int(ramp->stride);
    if (!stride) return std::nullopt;
    if (ramp->base.type().is_scalar()) return LinearIndex{ramp->base, *stride};
    const auto inner = as_linear(ramp->base);
    // A ramp of ramps, each going on where the one before ends.
    const bool goes_on = inner && inner->stride * ramp->base.type().lanes() == *stride;
    return goes_on ? inner : std::nullopt;
  }
  if (const auto* splat = index.as<Broadcast>()) {
    if (splat->value.type().is_scalar()) return LinearIndex{splat->value, 0};
    return std::nullopt;
  }
  if (const auto* name = index.as<Variable>()) {
    const auto found = frame_.ramps.find(name->name);
    return found == frame_.ramps.end() ? std::nullopt : std::optional(found->second);
  }
  if (const auto* call = index.as<Call>()) {
    const bool is_marker =
        call->call_type == CallType::Operator && op_info(call->op).cls == OpClass::Marker;
    return is_marker ? as_linear(call->args[0]) : std::nullopt;
  }
  const bool is_ring =
      index.kind() == Kind::Add || index.kind() == Kind::Sub || index.kind() == Kind::Mul;
  if (!is_ring) return std::nullopt;
  const auto* node = index.as<Binary>();
  const auto a = as_linear(node->a), b = a ? as_linear(node->b) : std::nullopt;
  if (!b) return std::nullopt;
  const Expr base = binary(index.kind(), a->base, b->base);
  if (index.kind() == Kind::Add) return LinearIndex{base, a->stride + b->stride};
  if (index.kind() == Kind::Sub) return LinearIndex{base, a->stride - b->stride};
  const auto factor = as_const_int(a->stride == 0 ? a->base : b->base);
  if (a->stride == 0 && b->stride == 0) return LinearIndex{base, 0};
  if (!factor || (a->stride != 0 && b->stride != 0)) return std::nullopt;
  return LinearIndex{base, *factor * (a->stride == 0 ? b->stride : a->stride)};
}

static const Ramp* as_scalar_ramp(const Expr& index) {
  const auto* ramp = index.as<Ramp>();
  return ramp && ramp->base.type().is_scalar() ? ramp : nullptr;
}

// The pieces of a ramp of vectors, as indices of their own; empty when `index` is none.
static std::vector<Expr> pieces_of(const Expr& index) {
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

// Coordinates held inside of an image, and nothing that depends on data: what loop partitioning
// leaves to the borders, which run seldom.
FunctionGenerator::Coordinate FunctionGenerator::coordinate(const Expr& index) const {
  Coordinate result{true, false, index};
  walk(index, [&](const Expr& e) {
    if (e.type().is_scalar() || !result.is_plain) return false;
    const auto* name = e.as<Variable>();
    const auto known = name ? frame_.coordinates.find(name->name) : frame_.coordinates.end();
    if (known != frame_.coordinates.end()) {
      result.is_held |= known->second.is_held;
      return false;
    }
    const bool is_bound = e.kind() == Kind::Min || e.kind() == Kind::Max;
    const bool is_sum = e.kind() == Kind::Add || e.kind() == Kind::Sub || e.kind() == Kind::Mul;
    const bool is_leaf = e.kind() == Kind::Ramp || e.kind() == Kind::Broadcast;
    result.is_held |= is_bound;
    result.is_plain = is_bound || is_sum || is_leaf;
    return !is_leaf;
  });
  return result;
}

// Addresses extend indices by their sign.
Value* FunctionGenerator::index_vector(const Expr& index) {
  const Type type = index.type();
  return type.is_uint() ? convert(e_, Int(64, type.lanes()), type, value(index)) : value(index);
}

Value* FunctionGenerator::element_pointer(const Storage& from, Type type, Value* index) {
  return b_.CreateGEP(memory_type(e_, type), from.base, index);
}

Value* FunctionGenerator::predicate_value(const Expr& predicate) {
  return !predicate.defined() || is_const_true(predicate) ? nullptr : value(predicate);
}

Value* FunctionGenerator::from_memory(Type type, Value* v) {
  return type.is_bool() ? b_.CreateICmpNE(v, int_constant(v, 0)) : v;
}

Value* FunctionGenerator::to_memory(Type type, Value* v) {
  return type.is_bool() ? b_.CreateZExt(v, with_lanes(b_.getInt8Ty(), lanes_of(v))) : v;
}

static llvm::Align alignment_of(Type type) {
  return llvm::Align(static_cast<uint64_t>(type.bytes()));
}

// Lanes of one register. Wider vectors are read and written register by register: LLVM keeps an array
// in registers only where its loads are as wide as its stores, and else cuts whole vectors as one
// integer of thousands of bits.
static int native_lanes(const Machine& machine, Type type) {
  return std::max(1, machine.vector_bits / 8 / type.bytes());
}

// ---- loads ----

Value* FunctionGenerator::make(const Load& e) {
  const Storage& from = storage(e.name);
  Value* predicate = predicate_value(e.predicate);
  if (e.type.is_scalar()) return load_scalar(from, e.type, index64(e.index), predicate);
  return load_vector(from, e.type, e.index, predicate);
}

Value* FunctionGenerator::load_scalar(const Storage& from, Type type, Value* index,
                                      Value* predicate) {
  auto* memory = memory_type(e_, type);
  Value* pointer = element_pointer(from, type, index);
  if (!predicate)
    return from_memory(type,
                       tagged(b_.CreateAlignedLoad(memory, pointer, alignment_of(type)), from));
  return from_memory(type, value_if(predicate, [&]() -> Value* {
                       return tagged(b_.CreateAlignedLoad(memory, pointer, alignment_of(type)),
                                     from);
                     }));
}

Value* FunctionGenerator::load_vector(const Storage& from, Type type, const Expr& index,
                                      Value* predicate) {
  if (const auto linear = as_linear(index)) return load_linear(from, type, *linear, predicate);
  if (const auto* ramp = as_scalar_ramp(index); ramp && !predicate)
    return load_apart(from, type, index64(ramp->base), index64(ramp->stride));
  const std::vector<Expr> pieces = pieces_of(index);
  const Coordinate at = coordinate(index);
  if (pieces.empty() && at.is_plain && at.is_held && type.lanes() >= min_loop_lanes) {
    if (Value* loaded = load_held(from, type, index, predicate)) return loaded;
    if (!e_.machine.gathers(type))
      return gather_compactly(from, type, index_vector(index), predicate);
  }
  if (pieces.empty()) return gather(from, type, index_vector(index), predicate);
  std::vector<Value*> parts;
  int start = 0;
  for (const Expr& piece : pieces) {
    const int lanes = piece.type().lanes();
    Value* mask = predicate ? slice(e_, predicate, start, lanes) : nullptr;
    parts.push_back(load_vector(from, type.with_lanes(lanes), piece, mask));
    start += lanes;
  }
  return concat(e_, parts);
}

Value* FunctionGenerator::load_linear(const Storage& from, Type type, const LinearIndex& index,
                                      Value* predicate) {
  Value* first = index64(index.base);
  const int lanes = type.lanes();
  const int64_t stride = index.stride, last = stride * (lanes - 1);
  if (stride == 0) {
    Value* any = predicate ? b_.CreateOrReduce(predicate) : nullptr;
    return splat(e_, load_scalar(from, type.element_of(), first, any), lanes);
  }
  if (stride == 1) return load_dense(from, type, first, predicate);
  if (stride < 0 && stride >= -4 && (!predicate || stride == -1)) {
    Value* lowest = b_.CreateAdd(first, int64(last));
    Value* upward =
        stride == -1 ? load_dense(from, type, lowest, predicate ? reverse(e_, predicate) : nullptr)
                     : load_strided(from, type, lowest, -stride);
    return reverse(e_, upward);
  }
  if (predicate) {
    // A scalar base and small constant distances: 32-bit lanes where they do, for the machine's
    // wider gathers.
    const bool is_short = std::abs(stride) < (INT32_MAX / lanes);
    llvm::Type* distance = is_short ? b_.getInt32Ty() : b_.getInt64Ty();
    Value* step = llvm::ConstantInt::get(distance, static_cast<uint64_t>(stride), true);
    Storage shifted = from;
    shifted.base = element_pointer(from, type, first);
    return gather(shifted, type, b_.CreateMul(iota(e_, distance, lanes), splat(e_, step, lanes)),
                  predicate);
  }
  return stride > 0 && stride <= 4 ? load_strided(from, type, first, stride)
                                   : load_apart(from, type, first, int64(stride));
}

Value* FunctionGenerator::load_dense(const Storage& from, Type type, Value* first,
                                     Value* predicate) {
  const int native = native_lanes(e_.machine, type), lanes = type.lanes();
  if (!predicate && lanes > native) {
    std::vector<Value*> parts;
    for (int at = 0; at < lanes; at += native) {
      const Type part = type.with_lanes(std::min(native, lanes - at));
      parts.push_back(load_dense(from, part, b_.CreateAdd(first, int64(at)), nullptr));
    }
    return concat(e_, parts);
  }
  auto* vector = with_lanes(memory_type(e_, type), lanes);
  Value* pointer = element_pointer(from, type, first);
  if (!predicate)
    return from_memory(type,
                       tagged(b_.CreateAlignedLoad(vector, pointer, alignment_of(type)), from));
  Value* off = llvm::Constant::getNullValue(vector);
  return from_memory(
      type, tagged(b_.CreateMaskedLoad(vector, pointer, alignment_of(type), predicate, off), from));
}

// n lanes at distance s: s dense loads of n, the last moved back to end with the last lane, and
// each lane picked from the load that has it. The picks of later loads are put over those of
// earlier ones.
Value* FunctionGenerator::load_strided(const Storage& from, Type type, Value* first,
                                       int64_t stride) {
  const int n = type.lanes(), s = static_cast<int>(stride), last_start = (n - 1) * s - (n - 1);
  Value* result = nullptr;
  for (int part = 0; part < s; part++) {
    const int start = std::min(part * n, last_start);
    Value* index = b_.CreateAdd(first, int64(start));
    Value* loaded = load_dense(from, type, index, nullptr);
    std::vector<int> picks;
    for (int i = 0; i < n; i++) {
      const int offset = i * s - start;
      const bool is_here = offset >= 0 && offset < n && i * s >= part * n;
      picks.push_back(is_here ? (result ? n : 0) + offset : result ? i : -1);
    }
    result = shuffle(e_, result ? result : loaded, loaded, picks);
  }
  return result;
}

Value* FunctionGenerator::lane_index(Value* first, Value* stride, int lane) {
  Value* number = int64(lane);
  return b_.CreateAdd(first, b_.CreateMul(stride, number));
}

Value* FunctionGenerator::load_apart(const Storage& from, Type type, Value* first, Value* stride) {
  std::vector<Value*> lanes;
  for (int i = 0; i < type.lanes(); i++) {
    Value* index = lane_index(first, stride, i);
    lanes.push_back(load_scalar(from, type.element_of(), index, nullptr));
  }
  return from_lanes(e_, lanes);
}

// LLVM fills up a gather of an odd width with undefined indices, and may then give them the
// register of the result, which the machine forbids. Here the lanes that fill it up are off and
// have the index of the first.
Value* FunctionGenerator::gather_filled_up(const Storage& from, Type type, Value* indices,
                                           Value* mask) {
  const int lanes = type.lanes(), full = static_cast<int>(std::bit_ceil(unsigned(lanes)));
  std::vector<int> index_picks, mask_picks;
  for (int i = 0; i < full; i++) {
    index_picks.push_back(i < lanes ? i : 0);
    mask_picks.push_back(i < lanes ? i : lanes);
  }
  Value* none = llvm::Constant::getNullValue(mask->getType());
  Value* gathered = gather(from, type.with_lanes(full), shuffle(e_, indices, indices, index_picks),
                           shuffle(e_, mask, none, mask_picks));
  return slice(e_, gathered, 0, lanes);
}

// Lanes that are off take the index of the first that is on, so that each may load: one branch instead
// of one a lane.
Value* FunctionGenerator::where_any(Type type, Value* indices, Value* predicate,
                                    const std::function<Value*(Value* safe)>& load) {
  return value_if(b_.CreateOrReduce(predicate), [&] {
    Value* bits = b_.CreateBitCast(predicate, b_.getIntNTy(static_cast<unsigned>(type.lanes())));
    Value* first = b_.CreateBinaryIntrinsic(llvm::Intrinsic::cttz, bits, b_.getTrue());
    Value* index = splat(e_, b_.CreateExtractElement(indices, first), type.lanes());
    Value* loaded = load(b_.CreateSelect(predicate, indices, index));
    return b_.CreateSelect(predicate, loaded, llvm::Constant::getNullValue(loaded->getType()));
  });
}

Value* FunctionGenerator::gather(const Storage& from, Type type, Value* indices, Value* predicate) {
  if (predicate && !e_.machine.gathers(type)) {
    return where_any(type, indices, predicate,
                     [&](Value* safe) { return gather(from, type, safe, nullptr); });
  }
  if (predicate || (e_.machine.gathers(type) && e_.machine.gathers_fast)) {
    if (!std::has_single_bit(unsigned(type.lanes()))) {
      Value* all = splat(e_, b_.getTrue(), type.lanes());
      return gather_filled_up(from, type, indices, predicate ? predicate : all);
    }
    auto* vector = with_lanes(memory_type(e_, type), type.lanes());
    Value* pointers = element_pointer(from, type, indices);
    Value* off = llvm::Constant::getNullValue(vector);
    Value* mask = predicate ? predicate : splat(e_, b_.getTrue(), type.lanes());
    auto* gathered = b_.CreateMaskedGather(vector, pointers, alignment_of(type), mask, off);
    return from_memory(type, tagged(gathered, from));
  }
  indices = b_.CreateSExt(indices, with_lanes(b_.getInt64Ty(), type.lanes()));
  std::vector<Value*> lanes;
  for (int i = 0; i < type.lanes(); i++)
    lanes.push_back(load_scalar(from, type.element_of(), lane(e_, indices, i), nullptr));
  return from_lanes(e_, lanes);
}

// As gather, in a tenth of the code: the lanes go through memory.
//   spilled = indices;  for i: picked[i] = from[spilled[i]];  result = picked
Value* FunctionGenerator::gather_in_loop(const Storage& from, Type type, Value* indices) {
  llvm::Type *element = memory_type(e_, type), *number = indices->getType()->getScalarType();
  const auto lanes = static_cast<uint64_t>(type.lanes());
  Value* spilled = scratch(0, indices->getType());
  Value* picked = scratch(1, with_lanes(element, type.lanes()));
  const llvm::Align aligned(64);
  b_.CreateAlignedStore(indices, spilled, aligned);
  llvm::BasicBlock *before = b_.GetInsertBlock(), *body = new_block("lane"),
                   *after = new_block("lanes");
  b_.CreateBr(body);
  b_.SetInsertPoint(body);
  llvm::PHINode* counter = b_.CreatePHI(b_.getInt64Ty(), 2);
  counter->addIncoming(b_.getInt64(0), before);
  Value* index = b_.CreateLoad(number, b_.CreateGEP(number, spilled, counter));
  Value* pointer = element_pointer(from, type, b_.CreateSExt(index, b_.getInt64Ty()));
  Value* loaded = tagged(b_.CreateAlignedLoad(element, pointer, alignment_of(type)), from);
  b_.CreateStore(loaded, b_.CreateGEP(element, picked, counter));
  Value* next = b_.CreateAdd(counter, b_.getInt64(1));
  counter->addIncoming(next, body);
  b_.CreateCondBr(b_.CreateICmpULT(next, b_.getInt64(lanes)), body, after);
  b_.SetInsertPoint(after);
  return from_memory(type,
                     b_.CreateAlignedLoad(with_lanes(element, type.lanes()), picked, aligned));
}

Value* FunctionGenerator::gather_compactly(const Storage& from, Type type, Value* indices,
                                           Value* predicate) {
  if (!predicate) return gather_in_loop(from, type, indices);
  return where_any(type, indices, predicate,
                   [&](Value* safe) { return gather_in_loop(from, type, safe); });
}

// Memory of the function for values that live in it for a moment; as large as the largest.
Value* FunctionGenerator::scratch(size_t slot, llvm::Type* type) {
  llvm::AllocaInst*& block = frame_.scratch[slot];
  const auto size = [&](llvm::Type* t) { return e_.module.getDataLayout().getTypeAllocSize(t); };
  if (!block) {
    block = entry_alloca(type, 1, "scratch");
    block->setAlignment(llvm::Align(64));
    block->setMetadata(scratch_mark, llvm::MDNode::get(e_.context(), {}));
  } else if (size(block->getAllocatedType()) < size(type)) {
    block->setAllocatedType(type);
  }
  return block;
}

// ---- stores ----

void FunctionGenerator::make(const Store& s) {
  const MemoScope scope(*this, false);
  const Type type = s.value.type();
  Value* stored = value(s.value);
  Value* predicate = predicate_value(s.predicate);
  const Storage& to = storage(s.name);
  if (type.is_scalar()) return store_scalar(to, type, index64(s.index), stored, predicate);
  store_vector(to, type, s.index, stored, predicate);
}

void FunctionGenerator::store_scalar(const Storage& to, Type type, Value* index, Value* stored,
                                     Value* predicate) {
  Value* pointer = element_pointer(to, type, index);
  const auto store = [&] {
    tagged(b_.CreateAlignedStore(to_memory(type, stored), pointer, alignment_of(type)), to);
  };
  predicate ? if_true(predicate, store) : store();
}

void FunctionGenerator::store_dense(const Storage& to, Type type, Value* first, Value* stored,
                                    Value* predicate) {
  const int native = native_lanes(e_.machine, type), lanes = type.lanes();
  if (!predicate && lanes > native) {
    for (int at = 0; at < lanes; at += native) {
      const int count = std::min(native, lanes - at);
      store_dense(to, type.with_lanes(count), b_.CreateAdd(first, int64(at)),
                  slice(e_, stored, at, count), nullptr);
    }
    return;
  }
  Value *pointer = element_pointer(to, type, first), *bytes = to_memory(type, stored);
  if (predicate) {
    tagged(b_.CreateMaskedStore(bytes, pointer, alignment_of(type), predicate), to);
  } else {
    tagged(b_.CreateAlignedStore(bytes, pointer, alignment_of(type)), to);
  }
}

void FunctionGenerator::store_vector(const Storage& to, Type type, const Expr& index, Value* stored,
                                     Value* predicate) {
  const int lanes = type.lanes();
  const auto linear = as_linear(index);
  if (linear && linear->stride == 1)
    return store_dense(to, type, index64(linear->base), stored, predicate);
  if (linear && linear->stride == -1) {
    Value* lowest = b_.CreateSub(index64(linear->base), int64(lanes - 1));
    return store_dense(to, type, lowest, reverse(e_, stored),
                       predicate ? reverse(e_, predicate) : nullptr);
  }
  const std::vector<Expr> pieces = linear ? std::vector<Expr>{} : pieces_of(index);
  int start = 0;
  for (const Expr& piece : pieces) {
    const int part = piece.type().lanes();
    Value* mask = predicate ? slice(e_, predicate, start, part) : nullptr;
    store_vector(to, type.with_lanes(part), piece, slice(e_, stored, start, part), mask);
    start += part;
  }
  if (!pieces.empty()) return;
  const auto* ramp = as_scalar_ramp(index);
  if (!linear && (!ramp || predicate))
    return scatter(to, type, index_vector(index), stored, predicate);
  Value* first = index64(linear ? linear->base : ramp->base);
  Value* stride = linear ? int64(linear->stride) : index64(ramp->stride);
  for (int i = 0; i < lanes; i++) {
    store_scalar(to, type.element_of(), lane_index(first, stride, i), lane(e_, stored, i),
                 predicate ? lane(e_, predicate, i) : nullptr);
  }
}

// In the order of the lanes, so that of equal indices the last lane stays.
void FunctionGenerator::scatter(const Storage& to, Type type, Value* indices, Value* stored,
                                Value* predicate) {
  if (e_.machine.has_avx512() && e_.machine.gathers(type)) {
    Value* mask = predicate ? predicate : splat(e_, b_.getTrue(), type.lanes());
    Value* pointers = element_pointer(to, type, indices);
    tagged(b_.CreateMaskedScatter(to_memory(type, stored), pointers, alignment_of(type), mask), to);
    return;
  }
  for (int i = 0; i < type.lanes(); i++) {
    Value* index = b_.CreateSExt(lane(e_, indices, i), b_.getInt64Ty());
    store_scalar(to, type.element_of(), index, lane(e_, stored, i),
                 predicate ? lane(e_, predicate, i) : nullptr);
  }
}

}  // namespace retrograde::codegen
