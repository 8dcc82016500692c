// Code for loads and stores, chosen by the form of the index vector:
//
//   dense       base + i                  a vector load or store; base - i: the same, reversed
//   strided     base + s i, 2 <= |s| <= 4 loads: the vectors that cover the lanes, and shuffles; under a predicate masked
//                                         vectors if the machine has them
//   apart       base + s i                scalars at equal distances, s any scalar
//   pieces      a ramp of vectors         one access for each piece
//   broadcast   base                      one scalar
//   arbitrary                             gather or scatter if the machine has it, else scalars
//
// No access touches memory outside the span from its lowest to its highest lane. A predicated access touches only the
// span of the lanes whose predicate is true.
#pragma once

#include <optional>
#include <vector>

#include "codegen/values/values.h"

namespace retrograde::codegen {

// ---- access.cpp: indices and addresses ----

std::optional<LinearIndex> as_linear(const Frame& frame, const Expr& index);
// The index as a ramp of scalars; null if it is not one.
const ir::Ramp* as_scalar_ramp(const Expr& index);
// The pieces of a ramp of vectors, each as an index; empty if the index is not such a ramp.
std::vector<Expr> pieces_of(const Expr& index);
Coordinate coordinate_of(const Frame& frame, const Expr& index);

Value* element_pointer(Emitter& e, const Storage& from, Type type, Value* index);
Value* lane_index(Emitter& e, Value* first, Value* stride, int lane);
llvm::Align alignment_of(Type type);
int native_lanes(const Machine& machine, Type type);
// can_be_one_access: whether a kernel may access these consecutive lanes with one instruction. is_aligned: tests at run
// time whether the address is aligned for that.
bool can_be_one_access(const Emitter& e, const Storage& storage, Type type);
Value* is_aligned(FunctionContext& c, Value* pointer, Type type);
uint64_t access_bytes(Type type);
template <class Instruction>
Instruction* tagged(Instruction* instruction, const Storage& storage) {
  if (storage.alias) instruction->setMetadata(llvm::LLVMContext::MD_tbaa, storage.alias);
  return instruction;
}

// ---- loads.cpp, clamped_loads.cpp ----

Value* load(Values& values, const ir::Load& e);
Value* load_dense(FunctionContext& c, const Storage& from, Type type, Value* first,
                  Value* predicate);
// Loops over the lanes, so that the code is no longer than that of one lane.
Value* gather_compactly(FunctionContext& c, const Storage& from, Type type, Value* indices,
                        Value* predicate);
// Loads a ramp that is clamped to an image's bounds. Null if the index has another form, or if a gather is equally fast
// on this machine.
Value* load_clamped(Values& values, const Storage& from, Type type, const Expr& index,
                    Value* predicate);

// ---- stores.cpp, atomics.cpp ----

void store(Values& values, const ir::Store& s);
// An atomic update of a value of at most 64 bits.
void atomic_store(Values& values, const ir::Store& s);

}  // namespace retrograde::codegen
