#include "lower/storage/promised_bounds.h"

#include <algorithm>

#include "diagnostics/error.h"
#include "ir/build.h"
#include "lower/checks/nest_checks.h"
#include "simplify/simplify.h"

namespace retrograde::lower {

namespace {

Interval aligned(Interval range, const Bound& bound) {
  const Expr &m = bound.modulus, &r = bound.remainder;
  if (r.defined()) range.min = simplify((range.min - r) / m * m + r);
  Expr extent = range.max - range.min + 1;
  range.max = simplify(range.min + (extent + m - 1) / m * m - 1);
  return range;
}

}  // namespace

void apply_promised_bounds(const LoopedFunc& f, Box& box, std::vector<Stmt>& checks) {
  for (const Bound& bound : f.schedule.bounds) {
    size_t d = std::ranges::find(f.func->args, bound.var) - f.func->args.begin();
    RETROGRADE_ASSERT(d < box.size(), "bound on an unknown dimension");
    if (bound.extent.defined()) {
      Interval promised;
      promised.min = bound.min.defined() ? bound.min : box[d].min;
      promised.max = simplify(promised.min + bound.extent - 1);
      checks.push_back(bound_check(f, static_cast<int>(d), box[d], promised));
      box[d] = promised;
    }
    if (bound.modulus.defined()) box[d] = aligned(box[d], bound);
  }
}

}  // namespace retrograde::lower
