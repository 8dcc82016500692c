// Selects with an expensive arm: the arm is evaluated behind a branch, only if some lane needs it.
//
//   select(c, a, b), a costly:   b;  if any lane of c:  a;   then lane by lane one or the other
//
// Derivatives have such arms for rare cases. For example, the derivative of pow(x, g) with respect to x is g pow(x, g)
// / x, which reuses a power that the program computes anyway. Only if that power or x overflows or is 0 is it g pow(x,
// g - 1).
// If lanes differ at random, the branch is well predicted, because almost always some lane needs the arm. If they
// agree, the arm is skipped. Subexpressions that the arm shares with earlier code are not recomputed.
#include <unordered_set>

#include "codegen/values/values.h"
#include "ir/visit.h"

namespace retrograde::codegen {

using namespace ir;

// In vector additions: several times the cost of a mispredicted branch.
static constexpr int costly = 40;
// Nodes of an arm that are examined; arms for rare cases are small.
static constexpr size_t most_nodes = 128;

static int function_adds(const Expr& e) {
  const auto* call = e.as<Call>();
  return call && call->call_type == CallType::Operator ? op_info(call->op).work.function_adds : 0;
}

// Whether the functions in the arm that have no value yet cost more than a branch.
static bool is_costly(const Values& values, const Expr& arm) {
  if (!arm.type().is_float()) return false;
  std::unordered_set<const ExprNode*> seen;
  int adds = 0;
  walk(arm, [&](const Expr& e) {
    const bool is_new = seen.size() < most_nodes && !values.known(e) && seen.insert(e.get()).second;
    if (is_new) adds += function_adds(e);
    return is_new;
  });
  return adds >= costly;
}

// The arm if any lane of `wanted` is true; else `otherwise`.
static Value* value_if_any_lane(Values& values, Value* wanted, const Expr& arm, Value* otherwise) {
  return values.c.value_if(
      any_lane(values.c.e, wanted), [&] { return values.of(arm); }, otherwise);
}

Value* selected(Values& values, const Select& e) {
  Value* condition = values.of(e.condition);
  const bool is_costly_a = is_costly(values, e.when_true),
             is_costly_b = is_costly(values, e.when_false);
  Value* a = is_costly_a ? nullptr : values.of(e.when_true);
  Value* b = is_costly_b ? nullptr : values.of(e.when_false);
  const auto nothing = [&] { return llvm::Constant::getNullValue(llvm_type(values.c.e, e.type)); };
  if (!a) a = value_if_any_lane(values, condition, e.when_true, b ? b : nothing());
  if (!b) b = value_if_any_lane(values, values.c.b.CreateNot(condition), e.when_false, a);
  return values.c.b.CreateSelect(condition, a, b);
}

}  // namespace retrograde::codegen
