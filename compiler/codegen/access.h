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
#pragma once

#include <optional>
#include <vector>

#include "codegen/values.h"

namespace retrograde::codegen {

// ---- access.cpp: indices and addresses ----

std::optional<LinearIndex> as_linear(const Frame& frame, const Expr& index);
// A ramp of scalars; null where the index is none.
const ir::Ramp* as_scalar_ramp(const Expr& index);
// The pieces of a ramp of vectors, as indices of their own; empty where the index is none.
std::vector<Expr> pieces_of(const Expr& index);
Coordinate coordinate_of(const Frame& frame, const Expr& index);

Value* element_pointer(Emitter& e, const Storage& from, Type type, Value* index);
Value* lane_index(Emitter& e, Value* first, Value* stride, int lane);
llvm::Align alignment_of(Type type);
int native_lanes(const Machine& machine, Type type);
// Whether a kernel may access these lanes, one behind the other, at once; and whether they stand so.
bool can_be_one_access(const Emitter& e, const Storage& storage, Type type);
Value* is_aligned(FunctionContext& c, Value* pointer, Type type);
uint64_t access_bytes(Type type);
template <class Instruction>
Instruction* tagged(Instruction* instruction, const Storage& storage) {
  if (storage.alias) instruction->setMetadata(llvm::LLVMContext::MD_tbaa, storage.alias);
  return instruction;
}

// ---- loads.cpp, held_loads.cpp ----

Value* load(Values& values, const ir::Load& e);
Value* load_dense(FunctionContext& c, const Storage& from, Type type, Value* first,
                  Value* predicate);
// In a loop over the lanes: as much code as one lane takes.
Value* gather_compactly(FunctionContext& c, const Storage& from, Type type, Value* indices,
                        Value* predicate);
// Null where the index is no ramp that a bound holds inside of an image, or the machine does as well
// by a gather.
Value* load_held(Values& values, const Storage& from, Type type, const Expr& index,
                 Value* predicate);

// ---- stores.cpp, atomics.cpp ----

void store(Values& values, const ir::Store& s);
// An update of a value of at most 64 bits, from several iterations at once.
void atomic_store(Values& values, const ir::Store& s);

}  // namespace retrograde::codegen
