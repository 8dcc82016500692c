#include "lower/device/size_bounds.h"

#include <limits>

#include "ir/build.h"
#include "lower/expand_lets_in_scope.h"
#include "simplify/simplify.h"

namespace retrograde::lower {

SizeBounds::SizeBounds(const Kernel& kernel) {
  for (int d = 0; d < 3; ++d) {
    const auto axis = static_cast<size_t>(d);
    bind(block_index(kernel.name, d), 0, kernel.blocks[axis] - 1);
    bind(thread_index(kernel.name, d), 0, kernel.threads[axis] - 1);
  }
}

void SizeBounds::bind(const std::string& name, const Expr& min, const Expr& max) {
  const Expr first = simplify(min), last = simplify(max);
  facts_.bind(name, first, last);
  const Interval low = analysis::bounds_of(first, variables_),
                 high = analysis::bounds_of(last, variables_);
  variables_.push(name, Interval(low.min, high.max));
}

void SizeBounds::enter(const For& loop) {
  bind(loop.name, expand_lets_in_scope(loop.min, lets_),
       expand_lets_in_scope(loop.min + loop.extent - 1, lets_));
}

void SizeBounds::leave(const For& loop) {
  facts_.unbind(loop.name);
  variables_.pop(loop.name);
}

Expr SizeBounds::most(const Expr& size) {
  const Expr e = simplify(expand_lets_in_scope(cast_to(Int(32), size), lets_));
  facts_.forget();
  const int64_t constant = std::min(facts_.range(e).max, facts_.upper_bound(ir::sum_of(e)));
  // Larger constants are loose bounds; the symbolic bound is preferred to them.
  constexpr int64_t large = 1 << 16;
  if (constant <= large) return make_const(Int(32), std::max<int64_t>(constant, 0));
  const Expr symbolic = analysis::bounds_of(e, variables_).max;
  const bool is_known = symbolic.defined() && !any_node(symbolic, [](const Load&) { return true; });
  if (constant >= std::numeric_limits<int32_t>::max())
    return is_known ? simplify(symbolic) : Expr();
  const Expr most = make_const(Int(32), constant);
  return is_known ? simplify(min(symbolic, most)) : most;
}

}  // namespace retrograde::lower
