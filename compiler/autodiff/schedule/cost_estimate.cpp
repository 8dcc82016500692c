#include "autodiff/schedule/cost_estimate.h"

#include "ir/build.h"

namespace retrograde::ir {

double operations_of(const Expr& node) {
  const auto* call = node.as<Call>();
  if (!call) {
    const bool computes = node.as<Binary>() || node.as<Select>() || node.as<Cast>();
    return node.type().is_float() && computes ? 1 : 0;
  }
  if (call->call_type != CallType::Operator) return 1;
  return op_info(call->op).cls == OpClass::Marker ? 0 : call->op == Op::strong_mul ? 1 : 4;
}

}  // namespace retrograde::ir
