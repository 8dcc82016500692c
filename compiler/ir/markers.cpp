#include "ir/markers.h"

#include <algorithm>
#include <initializer_list>

#include "ir/visit.h"

namespace retrograde::ir {

namespace {

template <class Tree>
Tree without(std::initializer_list<Op> markers, const Tree& tree) {
  return rewrite(tree, [&](const Expr& e, const auto& recurse) {
    const auto* call = e.as<Call>();
    const bool is_marker =
        call && std::any_of(markers.begin(), markers.end(), [&](Op op) { return call->is_op(op); });
    return is_marker ? recurse(call->args[0]) : Expr();
  });
}

}  // namespace

Expr without_likely(const Expr& e) { return without({Op::likely, Op::likely_if_innermost}, e); }
Stmt without_likely(const Stmt& s) { return without({Op::likely, Op::likely_if_innermost}, s); }
Expr without_promises(const Expr& e) { return without({Op::promise_clamped}, e); }

}  // namespace retrograde::ir
