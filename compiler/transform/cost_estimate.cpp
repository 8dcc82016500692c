#include "transform/cost_estimate.h"

#include <algorithm>

#include "ir/build.h"
#include "ir/walk_once.h"
#include "simplify/simplify.h"

namespace retrograde::transform {

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

namespace {

bool is_read(const Expr& node) {
  const auto* call = node.as<Call>();
  return call && call->call_type != CallType::Operator;
}

double integer_operations(const Expr& node) {
  const bool computes = node.as<Binary>() || node.as<Select>() || node.as<Call>();
  return computes ? node.type().bits() / 32.0 : 0;
}

}  // namespace

double operations_of_values(const std::vector<Expr>& values,
                            FunctionRef<double(const Call&)> of_call) {
  double total = 0;
  NodeSet seen;
  const auto count_index = [&](const Expr& e) {
    total += is_read(e) ? of_call(*e.as<Call>()) : operations_of(e);
    return true;
  };
  for (const Expr& value : values) {
    const bool counts_integers = !value.type().is_float();
    walk_once(value, seen, [&](const Expr& e) {
      if (is_read(e)) {
        total += of_call(*e.as<Call>());
        for (const Expr& index : e.as<Call>()->args) walk_once(index, seen, count_index);
        return false;
      }
      const bool is_integer = !e.type().is_float();
      total += counts_integers && is_integer ? integer_operations(e) : operations_of(e);
      return true;
    });
  }
  return total;
}

double terms_of(const Definition& stage, double of_unknown) {
  double terms = 1;
  for (const ReductionVariable& r : stage.rvars) {
    const auto extent = as_const_int(simplify(r.extent));
    terms *= extent ? static_cast<double>(*extent) : of_unknown;
  }
  return terms;
}

}  // namespace retrograde::transform
