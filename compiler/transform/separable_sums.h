// separable_sums.h -- sums of products with factors that depend on few of the variables: which terms may be added first.
//
//   f(x, y) = u(x) a(y) g(x, y / n) + v(x) a(y) g(x, y / n) + ...  =>  f(x, y) = a(y) (u(x) g(x, y / n) + v(x) g(x, y / n)) + ...
//
//   f(x, y) += w(x, r.x) w(y, r.y) g(x / n + r.x, y / n + r.y)
//       =>  f(x, y) += w(y, r.y) rows(x, y / n + r.y)  with  rows(x, y) += w(x, r.x) g(x / n + r.x, y)
//
// The sums in parentheses, and `rows`, depend on y through the index of the grid alone (coarse_axis.h).
#pragma once

#include <optional>
#include <vector>

#include "graph/function.h"
#include "transform/coarse_axis.h"

namespace retrograde::transform {

// The first rule, for each sum within the expression: terms with the same factors that depend on the variable
// otherwise, and with the same index, are added before they are multiplied. The same handle where no sum has such.
Expr with_grouped_terms(const Expr& e, CoarseAxis& axis);

// The second rule for one product.
struct SplitProduct {
  std::vector<ReductionVariable> inner, outer;  // neither is empty
  Expr inner_factor, outer_factor;
  Expr index;
};
std::optional<SplitProduct> split_product(const Expr& product,
                                          const std::vector<ReductionVariable>& domain,
                                          CoarseAxis& axis);

}  // namespace retrograde::transform
