// Choices of which an arm takes long: it runs where some lane wants it, behind a branch.
//
//   select(c, a, b), a costly:   b;  if any lane of c:  a;   then lane by lane the one or the other
//
// Derivatives have such arms for what is rare: that of pow(x, g) by x is  g pow(x, g) / x  of a
// power that the program has anyway, but g pow(x, g - 1) where that power or x overflows or is 0.
// Where lanes differ at random the branch costs nothing to predict, for some lane nearly always
// wants the arm; where they agree, it is skipped. What the arm shares with code before it is not
// computed again.
#include <unordered_set>

#include "codegen/function_generator.h"
#include "ir/visit.h"

namespace retrograde::codegen {

using namespace ir;

// In additions of a vector: some times a mispredicted branch.
static constexpr int costly = 40;
// Of an arm, that are looked at: what is rare is small.
static constexpr size_t most_nodes = 128;

static int function_adds(const Expr& e) {
  const auto* call = e.as<Call>();
  return call && call->call_type == CallType::Operator ? op_info(call->op).work.function_adds : 0;
}

// Whether functions that have no value yet make the arm worth a branch.
bool FunctionGenerator::is_costly(const Expr& arm) const {
  if (!arm.type().is_float()) return false;
  std::unordered_set<const ExprNode*> seen;
  int adds = 0;
  walk(arm, [&](const Expr& e) {
    const bool is_new = seen.size() < most_nodes && !known(&MemoFrame::values, e) && seen.insert(e.get()).second;
    if (is_new) adds += function_adds(e);
    return is_new;
  });
  return adds >= costly;
}

// The arm, where a lane of `wanted` is true; else `otherwise`.
Value* FunctionGenerator::value_where(Value* wanted, const Expr& arm, Value* otherwise) {
  Value* any = wanted->getType()->isVectorTy() ? b_.CreateOrReduce(wanted) : wanted;
  llvm::BasicBlock *before = b_.GetInsertBlock(), *end = nullptr;
  Value* computed = nullptr;
  if_true(any, [&] {
    computed = value(arm);
    end = b_.GetInsertBlock();
  });
  llvm::PHINode* result = b_.CreatePHI(computed->getType(), 2);
  result->addIncoming(computed, end);
  result->addIncoming(otherwise, before);
  return result;
}

Value* FunctionGenerator::make(const Select& e) {
  Value* condition = value(e.condition);
  const bool is_costly_a = is_costly(e.when_true), is_costly_b = is_costly(e.when_false);
  Value* a = is_costly_a ? nullptr : value(e.when_true);
  Value* b = is_costly_b ? nullptr : value(e.when_false);
  const auto nothing = [&] { return llvm::Constant::getNullValue(llvm_type(e_, e.type)); };
  if (!a) a = value_where(condition, e.when_true, b ? b : nothing());
  if (!b) b = value_where(b_.CreateNot(condition), e.when_false, a);
  return b_.CreateSelect(condition, a, b);
}

}  // namespace retrograde::codegen
