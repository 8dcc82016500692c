// Translates the expressions of one lowered function to LLVM values. A node that several expressions share is evaluated
// once.
#pragma once

#include <string>

#include "codegen/function_context.h"

namespace retrograde::codegen {

class Values {
 public:
  explicit Values(FunctionContext& context) : c(context) {}

  FunctionContext& c;

  Value* of(const Expr& e);
  Value* alone(const Expr& e);  // in its own memo scope
  // Null if the node has no value yet.
  Value* known(const Expr& e) const { return known(&MemoFrame::values, e); }
  Value* predicate(const Expr& e);  // null if always true
  // A scalar index as a 64-bit integer. Its + - * are computed in 64 bits: modulo 2^32 the result equals the int32
  // value, and an index that fits int32 is exact. Addresses then need no sign extension, which would hide their
  // structure from LLVM, and large buffers work.
  Value* index64(const Expr& e);
  // Lanes have 32 or 64 bits; addresses sign-extend them.
  Value* index_vector(const Expr& e);
  void bind(const std::string& name, const Expr& bound);

 private:
  Value* known(Memo MemoFrame::*memo, const Expr& e) const;
  // The node's known value, or else the result of `make`, which is then recorded.
  Value* memoised(Memo MemoFrame::*memo, const Expr& e, Value* (Values::*make)(const Expr&));
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

// ---- special forms that have better code than node-by-node translation ----

// narrow_products.cpp. partly_reduced: the operand of the reduction, partly reduced already. sum_of_products: the sum
// if it has products to be added in pairs, else null.
Value* partly_reduced(Values& values, const ir::VectorReduce& e);
Value* sum_of_products(Values& values, const Expr& e);
// strong_products.cpp: the sum if it contains a strong product that may fuse, else null.
Value* sum_with_strong_product(Values& values, const ir::Binary& e);
// costly_arms.cpp
Value* selected(Values& values, const ir::Select& e);

}  // namespace retrograde::codegen
