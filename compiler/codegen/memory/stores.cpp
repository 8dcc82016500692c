#include "codegen/memory/access.h"

namespace retrograde::codegen {

using namespace ir;

namespace {

void store_scalar(FunctionContext& c, const Storage& to, Type type, Value* index, Value* stored,
                  Value* predicate) {
  Value* pointer = element_pointer(c.e, to, type, index);
  const auto store = [&] {
    tagged(c.b.CreateAlignedStore(to_memory(c.e, type, stored), pointer, alignment_of(type)), to);
  };
  predicate ? c.if_true(predicate, store) : store();
}

void store_dense(FunctionContext& c, const Storage& to, Type type, Value* first, Value* stored,
                 Value* predicate) {
  if (predicate && c.e.machine.is_device()) {
    for (int i = 0; i < type.lanes(); ++i)
      store_scalar(c, to, type.element_of(), c.b.CreateAdd(first, c.int64(i)), lane(c.e, stored, i),
                   lane(c.e, predicate, i));
    return;
  }
  const int native = native_lanes(c.e.machine, type), lanes = type.lanes();
  if (!predicate && lanes > native) {
    for (int at = 0; at < lanes; at += native) {
      const int count = std::min(native, lanes - at);
      store_dense(c, to, type.with_lanes(count), c.b.CreateAdd(first, c.int64(at)),
                  slice(c.e, stored, at, count), nullptr);
    }
    return;
  }
  Value *pointer = element_pointer(c.e, to, type, first), *bytes = to_memory(c.e, type, stored);
  if (can_be_one_access(c.e, to, type)) {
    Value* whole = is_aligned(c, pointer, type);
    c.if_true(whole, [&] {
      tagged(c.b.CreateAlignedStore(bytes, pointer, llvm::Align(access_bytes(type))), to);
    });
    c.if_true(c.b.CreateNot(whole), [&] {
      for (int i = 0; i < lanes; ++i) {
        Value* at = c.b.CreateGEP(memory_type(c.e, type), pointer, c.int64(i));
        tagged(c.b.CreateAlignedStore(lane(c.e, bytes, i), at, alignment_of(type)), to);
      }
    });
    return;
  }
  if (predicate) {
    tagged(c.b.CreateMaskedStore(bytes, pointer, alignment_of(type), predicate), to);
  } else {
    tagged(c.b.CreateAlignedStore(bytes, pointer, alignment_of(type)), to);
  }
}

// Stores in lane order: if indices are equal, the last lane wins.
void scatter(FunctionContext& c, const Storage& to, Type type, Value* indices, Value* stored,
             Value* predicate) {
  if (c.e.machine.has_avx512() && c.e.machine.gathers(type)) {
    Value* mask = predicate ? predicate : splat(c.e, c.b.getTrue(), type.lanes());
    Value* pointers = element_pointer(c.e, to, type, indices);
    tagged(
        c.b.CreateMaskedScatter(to_memory(c.e, type, stored), pointers, alignment_of(type), mask),
        to);
    return;
  }
  for (int i = 0; i < type.lanes(); i++) {
    Value* index = c.b.CreateSExt(lane(c.e, indices, i), c.b.getInt64Ty());
    store_scalar(c, to, type.element_of(), index, lane(c.e, stored, i),
                 predicate ? lane(c.e, predicate, i) : nullptr);
  }
}

void store_vector(Values& values, const Storage& to, Type type, const Expr& index, Value* stored,
                  Value* predicate) {
  FunctionContext& c = values.c;
  const int lanes = type.lanes();
  const auto linear = as_linear(c.frame, index);
  if (linear && linear->stride == 1)
    return store_dense(c, to, type, values.index64(linear->base), stored, predicate);
  if (linear && linear->stride == -1) {
    Value* lowest = c.b.CreateSub(values.index64(linear->base), c.int64(lanes - 1));
    return store_dense(c, to, type, lowest, reverse(c.e, stored),
                       predicate ? reverse(c.e, predicate) : nullptr);
  }
  const std::vector<Expr> pieces = linear ? std::vector<Expr>{} : pieces_of(index);
  int start = 0;
  for (const Expr& piece : pieces) {
    const int part = piece.type().lanes();
    Value* mask = predicate ? slice(c.e, predicate, start, part) : nullptr;
    store_vector(values, to, type.with_lanes(part), piece, slice(c.e, stored, start, part), mask);
    start += part;
  }
  if (!pieces.empty()) return;
  const auto* ramp = as_scalar_ramp(index);
  if (!linear && (!ramp || predicate))
    return scatter(c, to, type, values.index_vector(index), stored, predicate);
  Value* first = values.index64(linear ? linear->base : ramp->base);
  Value* stride = linear ? c.int64(linear->stride) : values.index64(ramp->stride);
  for (int i = 0; i < lanes; i++) {
    store_scalar(c, to, type.element_of(), lane_index(c.e, first, stride, i), lane(c.e, stored, i),
                 predicate ? lane(c.e, predicate, i) : nullptr);
  }
}

}  // namespace

void store(Values& values, const Store& s) {
  const MemoScope scope(values.c.frame, false);
  const Type type = s.value.type();
  Value* stored = values.of(s.value);
  Value* predicate = values.predicate(s.predicate);
  const Storage& to = values.c.storage(s.name);
  if (type.is_scalar())
    return store_scalar(values.c, to, type, values.index64(s.index), stored, predicate);
  store_vector(values, to, type, s.index, stored, predicate);
}

}  // namespace retrograde::codegen
