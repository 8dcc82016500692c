#include "ir/markers.h"

#include <algorithm>
#include <initializer_list>

#include "ir/visit.h"

namespace retrograde::ir {

namespace {

Expr without(std::initializer_list<Op> markers, const Expr& e) {
  return rewrite(e, [&](const Expr& node, const auto& recurse) {
    const auto* call = node.as<Call>();
    const bool is_marker =
        call && std::any_of(markers.begin(), markers.end(), [&](Op op) { return call->is_op(op); });
    return is_marker ? recurse(call->args[0]) : map_children(node, recurse);
  });
}

}  // namespace

Expr without_likely(const Expr& e) { return without({Op::likely, Op::likely_if_innermost}, e); }
Expr without_promises(const Expr& e) { return without({Op::promise_clamped}, e); }

}  // namespace retrograde::ir
