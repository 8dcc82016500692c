// chosen_values.h -- a definition that chooses by a short dimension as one Tuple of all that it chooses from.
//
//   spot(i, c) = select(c == 0, a(ray(i)), b(ray(i)))    over i and c
//   =>
//   {a(ray(i)), b(ray(i))}                               over i, with the adjoints spot_adj(i, 0) and spot_adj(i, 1)
//
// Both alternatives are then differentiated in one sweep. In a sweep for each c, or in one whose result is written out
// for each c (sums/chosen_terms.h), the adjoints of what they share would be computed once for each alternative.
#pragma once

#include <vector>

#include "autodiff/inversion/access_inversion.h"
#include "ir/visit.h"

namespace retrograde::autodiff {

// The values of a definition at each point of its domain.
struct StageValues {
  IterationDomain domain;
  std::vector<Expr> values, seeds;  // and the adjoints of the values
  std::vector<Expr> reads;          // reads of the values that the Func stores
};

// `is_active` says which leaves get an adjoint. A dimension by which these are read stays.
StageValues with_choices_as_values(StageValues stage, FunctionRef<bool(const Expr&)> is_active);

}  // namespace retrograde::autodiff
