#include "autoschedule/cost_estimate.h"

#include <algorithm>

#include "ir/build.h"
#include "ir/visit.h"

namespace retrograde::autoschedule {

Work work_of(const Expr& node) {
  bool floating = node.type().is_float();
  for_each_child(node, [&](const Expr& child) { floating |= child.type().is_float(); });
  const auto* call = node.as<Call>();
  if (!floating) return {0, 0, 0};
  if (call && call->call_type == CallType::Operator) return op_info(call->op).work;
  if (node.as<Mul>() || node.as<Div>() || node.as<Mod>()) return {0, 1, 0};
  return {node.as<Binary>() || node.as<Select>() || node.as<Cast>() ? 1 : 0, 0, 0};
}

namespace {

// By what is no constant: that would be a multiplication.
bool divides(const Expr& node) {
  if (const auto* quotient = node.as<Div>()) return !is_const(quotient->b);
  const auto* call = node.as<Call>();
  return call && call->is_op(Op::strong_div);
}

}  // namespace

double operations_of(const Expr& node) {
  const auto* call = node.as<Call>();
  if (call && call->call_type != CallType::Operator) return 1;
  if (!node.type().is_float()) return 0;
  const Work work = work_of(node);
  return std::max(work.adds, work.mults) + work.function_adds + (divides(node) ? 4 : 0);
}

}  // namespace retrograde::autoschedule
