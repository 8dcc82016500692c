// colouring.h -- colours the columns of a sparse matrix, so that columns of one colour are evaluated together.
//
// Columns that share no row may share a seed: in each row at most one of them is nonzero, so one product J v gives the
// entries of all of them (Curtis, Powell & Reid, On the estimation of sparse Jacobian matrices, J. Inst. Maths Applics
// 13, 1974; as colouring: Gebremedhin, Manne & Pothen, What color is your Jacobian?, SIAM Review 47, 2005, section 4).
// For the diagonal of a Hessian it suffices that neighbours differ (section 6.2 there).
//
// The columns are elements of an array, and the pattern of a pipeline is nearly the same at each of them. So the colour
// is a linear form modulo the number of colours,
//   colour(x) = (k_0 x_0 + k_1 x_1 + ...) mod n.
// It is valid if no difference of two conflicting columns is a multiple of n. It needs no table and no extents. For
// bands and stencils it finds the known optima: 3 for a band of 3, 5 for the five-point stencil. Differences are taken
// over the whole pattern, so a single dense row gives every column a colour of its own; graph_colouring.h handles such
// patterns.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "ir/expr.h"

namespace retrograde::autodiff {

struct Colouring {
  std::vector<int64_t> factors;  // for each dimension, in [0, count)
  int64_t count = 1;
  Expr of(const std::vector<Expr>& element) const;  // int32, in [0, count)
  int64_t of(const std::vector<int64_t>& element) const;
};

// The colouring with the fewest colours for which no nonzero difference has colour 0; nullopt if it needs more than
// `most`. Deterministic: the first in the order of (count, factors).
std::optional<Colouring> smallest_colouring(const std::vector<std::vector<int64_t>>& differences,
                                            size_t dimensions, int64_t most);

// A colour of its own for each element of a box: each factor is the product of the previous extents.
Colouring one_colour_each(const std::vector<int64_t>& extents);

}  // namespace retrograde::autodiff
