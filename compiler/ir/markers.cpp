#include "ir/markers.h"

#include "ir/visit.h"

namespace retrograde::ir {

namespace {

template <class Tree, class... Ops>
Tree without(const Tree& tree, Ops... markers) {
  return rewrite(tree, [&](const Expr& e, const auto& recurse) {
    const auto* marker = as_op(e, markers...);
    return marker ? recurse(marker->args[0]) : Expr();
  });
}

}  // namespace

Expr without_likely(const Expr& e) { return without(e, Op::likely, Op::likely_if_innermost); }
Stmt without_likely(const Stmt& s) { return without(s, Op::likely, Op::likely_if_innermost); }
Expr without_promises(const Expr& e) { return without(e, Op::promise_clamped); }

Expr without_any_promises(const Expr& e) {
  return without(e, Op::promise_clamped, Op::unsafe_promise_clamped);
}

}  // namespace retrograde::ir
