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

#include "codegen/values.h"
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

// The arm, where a lane of `wanted` is true; else `otherwise`.
static Value* value_where(Values& values, Value* wanted, const Expr& arm, Value* otherwise) {
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
  if (!a) a = value_where(values, condition, e.when_true, b ? b : nothing());
  if (!b) b = value_where(values, values.c.b.CreateNot(condition), e.when_false, a);
  return values.c.b.CreateSelect(condition, a, b);
}

}  // namespace retrograde::codegen
