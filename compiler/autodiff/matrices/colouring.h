// colouring -- columns of a sparse matrix that can be evaluated together.
//
// Columns that share no row may share a seed: in each row at most one of them is not zero, so one
// product J v gives the entries of all of them (Curtis, Powell & Reid, On the estimation of sparse
// Jacobian matrices, J. Inst. Maths Applics 13, 1974; as colouring: Gebremedhin, Manne & Pothen,
// What color is your Jacobian?, SIAM Review 47, 2005, section 4). For the diagonal of a Hessian it
// is enough that neighbours differ (section 6.2 there).
//
// Elements of an array are the columns, and the pattern of a pipeline looks nearly the same at each
// of them, so the colour here is a linear form modulo the number of colours,
//   colour(x) = (k_0 x_0 + k_1 x_1 + ...) mod n,
// right when no difference of two columns that conflict is a multiple of n. It needs no table and
// no extents; for bands and stencils it finds the known optima: 3 for a band of 3, 5 for the
// five-point stencil. Differences are taken over the whole pattern, so a single dense row makes
// every column a colour of its own; graph_colouring.h is for such.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "ir/expr.h"

namespace retrograde::autodiff {

struct Colouring {
  std::vector<int64_t> factors;  // one a dimension, in [0, count)
  int64_t count = 1;
  Expr of(const std::vector<Expr>& element) const;  // int32, in [0, count)
  int64_t of(const std::vector<int64_t>& element) const;
};

// The fewest colours for which no difference other than zero has colour 0; nullopt when more than
// `most` would be needed. Deterministic: the first in the order of (count, factors).
std::optional<Colouring> smallest_colouring(const std::vector<std::vector<int64_t>>& differences,
                                            size_t dimensions, int64_t most);

// One colour an element of a box: factors are the products of the extents before.
Colouring one_colour_each(const std::vector<int64_t>& extents);

}  // namespace retrograde::autodiff
