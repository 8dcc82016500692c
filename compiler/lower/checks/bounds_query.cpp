#include "lower/checks/bounds_query.h"

#include "lower/runtime_call.h"
#include "simplify/simplify.h"

namespace retrograde::lower {

Expr asks_for_bounds(const LoweredArgument& arg) {
  return call_op(Op::buffer_is_query, Bool(), {buffer_handle(arg)});
}

Stmt answer_query(const LoweredArgument& arg, const Box& required, const ShapeFacts& facts) {
  Substitution needed;
  for (size_t d = 0; d < required.size(); d++) {
    const int dimension = static_cast<int>(d);
    needed[fact_name(arg, Metadata::Min, dimension)] = required[d].min;
    needed[fact_name(arg, Metadata::Extent, dimension)] =
        simplify(required[d].max - required[d].min + 1);
  }
  const auto said = [&](const Expr& promise) {
    return facts.in_actual_facts(substitute(promise, needed));
  };
  std::vector<Expr> sides;
  Expr stride = 1;
  for (size_t d = 0; d < required.size(); d++) {
    const int dimension = static_cast<int>(d);
    const BufferConstraint promised = constraint_of(arg, dimension);
    const Expr min = promised.min.defined() ? said(promised.min) : required[d].min;
    const Expr extent =
        promised.extent.defined() ? said(promised.extent) : simplify(required[d].max - min + 1);
    needed[fact_name(arg, Metadata::Stride, dimension)] = stride;
    if (promised.stride.defined()) stride = said(promised.stride);
    needed[fact_name(arg, Metadata::Stride, dimension)] = stride;
    for (const Expr& side : {min, extent, stride}) sides.push_back(cast(Int(32), side));
    stride = stride * extent;
  }
  if (sides.empty()) return make_evaluate(0);
  return make_evaluate(call_runtime(
      "retrograde_answer_query",
      {buffer_handle(arg), Expr(static_cast<int32_t>(required.size())), pack(std::move(sides))}));
}

}  // namespace retrograde::lower
