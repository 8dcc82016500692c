#include <bit>
#include <cstdlib>

#include "codegen/llvm/cut_loops.h"
#include "codegen/memory/access.h"
#include "ir/build.h"

namespace retrograde::codegen {

using namespace ir;

// A loop is not worth it for fewer lanes.
constexpr int min_loop_lanes = 8;

// A kernel's masked load, lane by lane, so that the simulated device sees only accesses that happen.
static Value* load_lanes_under(FunctionContext& c, const Storage& from, Type type, Value* first,
                               Value* predicate) {
  std::vector<Value*> lanes;
  for (int i = 0; i < type.lanes(); ++i) {
    Value* pointer = element_pointer(c.e, from, type, c.b.CreateAdd(first, c.int64(i)));
    lanes.push_back(c.value_if(lane(c.e, predicate, i), [&]() -> Value* {
      return tagged(c.b.CreateAlignedLoad(memory_type(c.e, type), pointer, alignment_of(type)),
                    from);
    }));
  }
  return from_memory(c.e, type, from_lanes(c.e, lanes));
}

// A kernel's vector load: one access if the address is a multiple of its size, else lane by lane. Alignment is only
// known at run time, because it depends on the buffers.
static Value* load_if_aligned(FunctionContext& c, const Storage& from, Type type, Value* pointer) {
  auto* element = memory_type(c.e, type);
  return c.chosen(
      is_aligned(c, pointer, type),
      [&]() -> Value* {
        auto* vector = with_lanes(element, type.lanes());
        return tagged(c.b.CreateAlignedLoad(vector, pointer, llvm::Align(access_bytes(type))),
                      from);
      },
      [&]() -> Value* {
        std::vector<Value*> lanes;
        for (int i = 0; i < type.lanes(); ++i) {
          Value* at = c.b.CreateGEP(element, pointer, c.int64(i));
          lanes.push_back(tagged(c.b.CreateAlignedLoad(element, at, alignment_of(type)), from));
        }
        return from_lanes(c.e, lanes);
      });
}

Value* load_dense(FunctionContext& c, const Storage& from, Type type, Value* first,
                  Value* predicate) {
  if (predicate && c.e.machine.is_device())
    return load_lanes_under(c, from, type, first, predicate);
  const int native = native_lanes(c.e.machine, type), lanes = type.lanes();
  if (!predicate && lanes > native) {
    std::vector<Value*> parts;
    for (int at = 0; at < lanes; at += native) {
      const Type part = type.with_lanes(std::min(native, lanes - at));
      parts.push_back(load_dense(c, from, part, c.b.CreateAdd(first, c.int64(at)), nullptr));
    }
    return concat(c.e, parts);
  }
  auto* vector = with_lanes(memory_type(c.e, type), lanes);
  Value* pointer = element_pointer(c.e, from, type, first);
  if (can_be_one_access(c.e, from, type))
    return from_memory(c.e, type, load_if_aligned(c, from, type, pointer));
  if (!predicate)
    return from_memory(c.e, type,
                       tagged(c.b.CreateAlignedLoad(vector, pointer, alignment_of(type)), from));
  Value* off = llvm::Constant::getNullValue(vector);
  return from_memory(
      c.e, type,
      tagged(c.b.CreateMaskedLoad(vector, pointer, alignment_of(type), predicate, off), from));
}

namespace {

Value* load_scalar(FunctionContext& c, const Storage& from, Type type, Value* index,
                   Value* predicate) {
  auto* memory = memory_type(c.e, type);
  Value* pointer = element_pointer(c.e, from, type, index);
  const auto load = [&]() -> Value* {
    return tagged(c.b.CreateAlignedLoad(memory, pointer, alignment_of(type)), from);
  };
  return from_memory(c.e, type, predicate ? c.value_if(predicate, load) : load());
}

// Marks, among consecutive elements from `start` on, those of active lanes, which are s apart.
Value* mask_of_part(FunctionContext& c, Value* predicate, int start, int s) {
  const int n =
      static_cast<int>(llvm::cast<llvm::FixedVectorType>(predicate->getType())->getNumElements());
  std::vector<int> picks;
  for (int i = 0; i < n; i++) picks.push_back((start + i) % s == 0 ? (start + i) / s : n);
  return shuffle(c.e, predicate, llvm::Constant::getNullValue(predicate->getType()), picks);
}

// n lanes with stride s: s dense loads of n lanes, the last one shifted back so that it ends at the last lane. Shuffles
// pick each lane from the load that contains it, overlaying later loads on earlier ones. With a predicate, loads touch only
// the elements of active lanes: their masks do not change in a loop that ends a row of vectors.
Value* load_strided(FunctionContext& c, const Storage& from, Type type, Value* first,
                    int64_t stride, Value* predicate) {
  const int n = type.lanes(), s = static_cast<int>(stride), last_start = (n - 1) * s - (n - 1);
  Value* result = nullptr;
  for (int part = 0; part < s; part++) {
    const int start = std::min(part * n, last_start);
    Value* index = c.b.CreateAdd(first, c.int64(start));
    Value* mask = predicate ? mask_of_part(c, predicate, start, s) : nullptr;
    Value* loaded = load_dense(c, from, type, index, mask);
    std::vector<int> picks;
    for (int i = 0; i < n; i++) {
      const int offset = i * s - start;
      const bool is_here = offset >= 0 && offset < n && i * s >= part * n;
      picks.push_back(is_here ? (result ? n : 0) + offset : result ? i : -1);
    }
    result = shuffle(c.e, result ? result : loaded, loaded, picks);
  }
  return result;
}

Value* load_apart(FunctionContext& c, const Storage& from, Type type, Value* first, Value* stride) {
  std::vector<Value*> lanes;
  for (int i = 0; i < type.lanes(); i++) {
    Value* index = lane_index(c.e, first, stride, i);
    lanes.push_back(load_scalar(c, from, type.element_of(), index, nullptr));
  }
  return from_lanes(c.e, lanes);
}

// Gives inactive lanes the index of the first active one, so that every lane may load. This takes one branch instead of
// one per lane.
Value* load_if_any_lane(FunctionContext& c, Type type, Value* indices, Value* predicate,
                        const std::function<Value*(Value* safe)>& load) {
  return c.value_if(any_lane(c.e, predicate), [&] {
    Value* bits = c.b.CreateBitCast(predicate, c.b.getIntNTy(static_cast<unsigned>(type.lanes())));
    Value* first = c.b.CreateBinaryIntrinsic(llvm::Intrinsic::cttz, bits, c.b.getTrue());
    Value* index = splat(c.e, c.b.CreateExtractElement(indices, first), type.lanes());
    Value* loaded = load(c.b.CreateSelect(predicate, indices, index));
    return c.b.CreateSelect(predicate, loaded, llvm::Constant::getNullValue(loaded->getType()));
  });
}

Value* gather(FunctionContext& c, const Storage& from, Type type, Value* indices, Value* predicate);

// Pads a gather of an odd width. LLVM would pad it with undefined indices, and may then assign them the register of the
// result, which the machine forbids. Here the padding lanes are inactive and have the index of the first lane.
Value* gather_padded(FunctionContext& c, const Storage& from, Type type, Value* indices,
                     Value* mask) {
  const int lanes = type.lanes(), full = static_cast<int>(std::bit_ceil(unsigned(lanes)));
  std::vector<int> index_picks, mask_picks;
  for (int i = 0; i < full; i++) {
    index_picks.push_back(i < lanes ? i : 0);
    mask_picks.push_back(i < lanes ? i : lanes);
  }
  Value* none = llvm::Constant::getNullValue(mask->getType());
  Value* gathered =
      gather(c, from, type.with_lanes(full), shuffle(c.e, indices, indices, index_picks),
             shuffle(c.e, mask, none, mask_picks));
  return slice(c.e, gathered, 0, lanes);
}

Value* gather(FunctionContext& c, const Storage& from, Type type, Value* indices,
              Value* predicate) {
  if (predicate && !c.e.machine.gathers(type)) {
    return load_if_any_lane(c, type, indices, predicate,
                            [&](Value* safe) { return gather(c, from, type, safe, nullptr); });
  }
  if (predicate || (c.e.machine.gathers(type) && c.e.machine.gathers_fast)) {
    if (!std::has_single_bit(unsigned(type.lanes()))) {
      Value* all = splat(c.e, c.b.getTrue(), type.lanes());
      return gather_padded(c, from, type, indices, predicate ? predicate : all);
    }
    auto* vector = with_lanes(memory_type(c.e, type), type.lanes());
    Value* pointers = element_pointer(c.e, from, type, indices);
    Value* off = llvm::Constant::getNullValue(vector);
    Value* mask = predicate ? predicate : splat(c.e, c.b.getTrue(), type.lanes());
    auto* gathered = c.b.CreateMaskedGather(vector, pointers, alignment_of(type), mask, off);
    return from_memory(c.e, type, tagged(gathered, from));
  }
  std::vector<Value*> lanes;
  for (int i = 0; i < type.lanes(); i++) {
    // Extended one by one: a vector of 64-bit indices would need twice as many registers to unpack.
    Value* index = c.b.CreateSExt(lane(c.e, indices, i), c.b.getInt64Ty());
    lanes.push_back(load_scalar(c, from, type.element_of(), index, nullptr));
  }
  return from_lanes(c.e, lanes);
}

// Stack memory for short-lived values; as large as the largest of them.
Value* scratch(FunctionContext& c, size_t slot, llvm::Type* type) {
  llvm::AllocaInst*& block = c.frame.scratch[slot];
  const auto size = [&](llvm::Type* t) { return c.e.module.getDataLayout().getTypeAllocSize(t); };
  if (!block) {
    block = c.entry_alloca(type, 1, "scratch");
    block->setAlignment(llvm::Align(64));
    block->setMetadata(scratch_mark, llvm::MDNode::get(c.e.context(), {}));
  } else if (size(block->getAllocatedType()) < size(type)) {
    block->setAllocatedType(type);
  }
  return block;
}

// The same as a gather, in a tenth of the code: the lanes go through memory.
//   spilled = indices;  for i: picked[i] = from[spilled[i]];  result = picked
Value* gather_in_loop(FunctionContext& c, const Storage& from, Type type, Value* indices) {
  llvm::Type *element = memory_type(c.e, type), *number = indices->getType()->getScalarType();
  const auto lanes = static_cast<uint64_t>(type.lanes());
  Value* spilled = scratch(c, 0, indices->getType());
  Value* picked = scratch(c, 1, with_lanes(element, type.lanes()));
  const llvm::Align aligned(64);
  c.b.CreateAlignedStore(indices, spilled, aligned);
  llvm::BasicBlock *before = c.b.GetInsertBlock(), *body = c.new_block("lane"),
                   *after = c.new_block("lanes");
  c.b.CreateBr(body);
  c.b.SetInsertPoint(body);
  llvm::PHINode* counter = c.b.CreatePHI(c.b.getInt64Ty(), 2);
  counter->addIncoming(c.b.getInt64(0), before);
  Value* index = c.b.CreateLoad(number, c.b.CreateGEP(number, spilled, counter));
  Value* pointer = element_pointer(c.e, from, type, c.b.CreateSExt(index, c.b.getInt64Ty()));
  Value* loaded = tagged(c.b.CreateAlignedLoad(element, pointer, alignment_of(type)), from);
  c.b.CreateStore(loaded, c.b.CreateGEP(element, picked, counter));
  Value* next = c.b.CreateAdd(counter, c.b.getInt64(1));
  counter->addIncoming(next, body);
  c.b.CreateCondBr(c.b.CreateICmpULT(next, c.b.getInt64(lanes)), body, after);
  c.b.SetInsertPoint(after);
  return from_memory(c.e, type,
                     c.b.CreateAlignedLoad(with_lanes(element, type.lanes()), picked, aligned));
}

}  // namespace

Value* gather_compactly(FunctionContext& c, const Storage& from, Type type, Value* indices,
                        Value* predicate) {
  if (!predicate) return gather_in_loop(c, from, type, indices);
  return load_if_any_lane(c, type, indices, predicate,
                          [&](Value* safe) { return gather_in_loop(c, from, type, safe); });
}

namespace {

Value* load_linear(Values& values, const Storage& from, Type type, const LinearIndex& index,
                   Value* predicate) {
  FunctionContext& c = values.c;
  Value* first = values.index64(index.base);
  const int lanes = type.lanes();
  const int64_t stride = index.stride, last = stride * (lanes - 1);
  if (stride == 0) {
    Value* any = predicate ? any_lane(c.e, predicate) : nullptr;
    return splat(c.e, load_scalar(c, from, type.element_of(), first, any), lanes);
  }
  if (stride == 1) return load_dense(c, from, type, first, predicate);
  const bool may_be_strided = !predicate || (c.e.machine.gathers(type) && !c.e.machine.is_device());
  if (stride < 0 && stride >= -4 && (may_be_strided || stride == -1)) {
    Value* lowest = c.b.CreateAdd(first, c.int64(last));
    Value* active = predicate ? reverse(c.e, predicate) : nullptr;
    Value* upward = stride == -1 ? load_dense(c, from, type, lowest, active)
                                 : load_strided(c, from, type, lowest, -stride, active);
    return reverse(c.e, upward);
  }
  if (predicate && (stride < 0 || stride > 4 || !may_be_strided)) {
    // A scalar base and small constant offsets: 32-bit lane offsets if they fit, because gathers with those are wider.
    const bool is_short = std::abs(stride) < (INT32_MAX / lanes);
    llvm::Type* distance = is_short ? c.b.getInt32Ty() : c.b.getInt64Ty();
    Value* step = llvm::ConstantInt::get(distance, static_cast<uint64_t>(stride), true);
    Storage shifted = from;
    shifted.base = element_pointer(c.e, from, type, first);
    return gather(c, shifted, type,
                  c.b.CreateMul(iota(c.e, distance, lanes), splat(c.e, step, lanes)), predicate);
  }
  return stride > 0 && stride <= 4 ? load_strided(c, from, type, first, stride, predicate)
                                   : load_apart(c, from, type, first, c.int64(stride));
}

Value* load_vector(Values& values, const Storage& from, Type type, const Expr& index,
                   Value* predicate) {
  FunctionContext& c = values.c;
  if (const auto at = as_linear(c.frame, index))
    return load_linear(values, from, type, *at, predicate);
  if (const auto* ramp = as_scalar_ramp(index); ramp && !predicate)
    return load_apart(c, from, type, values.index64(ramp->base), values.index64(ramp->stride));
  const std::vector<Expr> pieces = pieces_of(index);
  const Coordinate at = coordinate_of(c.frame, index);
  if (pieces.empty() && at.is_plain && at.is_clamped && type.lanes() >= min_loop_lanes) {
    if (Value* loaded = load_clamped(values, from, type, index, predicate)) return loaded;
    if (!c.e.machine.gathers(type))
      return gather_compactly(c, from, type, values.index_vector(index), predicate);
  }
  if (pieces.empty()) return gather(c, from, type, values.index_vector(index), predicate);
  std::vector<Value*> parts;
  int start = 0;
  for (const Expr& piece : pieces) {
    const int lanes = piece.type().lanes();
    Value* mask = predicate ? slice(c.e, predicate, start, lanes) : nullptr;
    parts.push_back(load_vector(values, from, type.with_lanes(lanes), piece, mask));
    start += lanes;
  }
  return concat(c.e, parts);
}

}  // namespace

Value* load(Values& values, const Load& e) {
  FunctionContext& c = values.c;
  const Storage& from = c.storage(e.name);
  Value* predicate = values.predicate(e.predicate);
  if (e.type.is_scalar()) return load_scalar(c, from, e.type, values.index64(e.index), predicate);
  return load_vector(values, from, e.type, e.index, predicate);
}

}  // namespace retrograde::codegen
