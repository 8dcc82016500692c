// From the expressions of one lowered function to LLVM values. A node that several expressions share
// gets one value.
#pragma once

#include <string>

#include "codegen/function_context.h"

namespace retrograde::codegen {

class Values {
 public:
  explicit Values(FunctionContext& context) : c(context) {}

  FunctionContext& c;

  Value* of(const Expr& e);
  Value* alone(const Expr& e);  // in a scope of its own
  // Null: the node has none yet.
  Value* known(const Expr& e) const { return known(&MemoFrame::values, e); }
  Value* predicate(const Expr& e);  // null when always true
  // A scalar index as a 64-bit integer, computed in 64 bits as far as it is made of + - *: modulo
  // 2^32 that is its int32 value, and an index that fits int32 is exactly it. Addresses then need
  // no sign extension that hides their structure from LLVM, and large buffers work.
  Value* index64(const Expr& e);
  // Addresses extend indices by their sign.
  Value* index_vector(const Expr& e);
  void bind(const std::string& name, const Expr& bound);

 private:
  Value* known(Memo MemoFrame::*memo, const Expr& e) const;
  // Of a node that has one already, or what `make` gives.
  Value* remembered(Memo MemoFrame::*memo, const Expr& e, Value* (Values::*make)(const Expr&));
  Value* make_value(const Expr& e);
  Value* make_index64(const Expr& e);
  Value* make_immediate(const Expr& e);
  Value* make(const ir::Let& e);
  Value* make(const ir::Variable& e);
  Value* make(const ir::Ramp& e);
  Value* make(const ir::Shuffle& e);
  Value* make(const ir::VectorReduce& e);
  void bind_ramp(const std::string& name, const Expr& bound);
  bool rebinds(const std::string& name, const Expr& value) const;
};

// ---- forms that have better code than node by node ----

// narrow_products.cpp: what is to be reduced, some of it done already; the sum when it has products
// to be added in pairs, else null.
Value* reduced_in_part(Values& values, const ir::VectorReduce& e);
Value* sum_of_products(Values& values, const Expr& e);
// strong_products.cpp: the sum when it is one with a strong product that may fuse, else null.
Value* sum_with_strong_product(Values& values, const ir::Binary& e);
// costly_arms.cpp
Value* selected(Values& values, const ir::Select& e);

}  // namespace retrograde::codegen
