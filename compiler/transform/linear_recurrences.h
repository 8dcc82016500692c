// linear_recurrences.h -- finds updates that are linear recurrences of first or second order along one dimension.
//
//   y(r) = (1 - a) * x(r) + a * y(r - 1)
//   y(r) = y(r) + b * y(r - 1) + c * y(r - 2)
//   adj(n - 1 - r) = adj(n - 1 - r) + select(r > 0, a * adj(n - r), 0)      for r > 0, as adjoints are
//
// 1. The update has one reduction variable and no predicate. The variable moves one dimension of the written element,
//    by one element; the other indices do not use it.
// 2. The value is a float. Of its own Func it reads the old value, and the elements that one and two iterations before
//    wrote, which it multiplies by coefficients and adds. Coefficients do not depend on the reduction variable or on
//    the Func. Selects by the variable around such reads hold in all iterations but the first and last.
#pragma once

#include <optional>
#include <vector>

#include "graph/function.h"
#include "ir/interval.h"

namespace retrograde::transform {

struct LinearRecurrence {
  // Values of the reduction variable for which the rest holds, as far as they are in its domain; an end that is undefined
  // is the domain's.
  Interval steady;
  Expr value;
  // The factors of the elements from one, two, ... iterations before, as Float(64); undefined: 0.
  std::vector<Expr> coefficients;
  int order() const { return static_cast<int>(coefficients.size()); }
};

std::optional<LinearRecurrence> linear_recurrence(const FuncContents& f, const Definition& update);

// How many iterations before this one its own element that `place` reads was written, if that is a constant. 0: the
// element that this iteration writes.
std::optional<int64_t> iterations_before(const Definition& update, const std::vector<Expr>& place);

}  // namespace retrograde::transform
