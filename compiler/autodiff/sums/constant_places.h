// constant_places.h -- sums what a stage contributes to several constant indices of one Func in one reduction.
//
//   residual(i) = g(camera(0, k(i)), ..., camera(8, k(i)))
//
//   camera_adj(0, k(i)) += a0(i)
//   ...                               =>    places(k(i)) += {a0(i), ..., a8(i)}
//   camera_adj(8, k(i)) += a8(i)            camera_adj(c, k) = select(c == 0, places(k)[0], ..., places(k)[8])
//
// The terms share the adjoint of the stage and most of its partials. In updates of their own, or in a select by the
// index, each would compute all of that again. The Func of the sums has no dimension for the constant indices, and one
// value for each of them. It is built like any other adjoint: as a pointwise sum, a gather, a scatter or privatised
// copies, with long sums in double.
//
// Only contributions over the same iterations, from the same adjoints, are summed together, and only if that saves more
// operations than the memory traffic of the sums costs.
#pragma once

#include <vector>

#include "autodiff/sums/accumulation.h"

namespace retrograde::autodiff {

// Contributions that differ in the constant indices of some dimensions.
struct ConstantPlaces {
  std::vector<bool> fixed;  // for each dimension of the Func: whether its index is constant
  std::vector<std::vector<Expr>> indices;  // for each place: the constants, by fixed dimension
  AdjointTarget target;             // the sums: other dimensions, all values of each place in turn
  std::vector<Contribution> terms;  // contributions to `target`
};

// Moves contributions that are worth a shared sum out of the list.
std::vector<ConstantPlaces> take_constant_places(std::vector<Contribution>& contributions,
                                                 const AdjointTarget& target);
// The contributions to the Func itself, given the values of the sums at its other dimensions.
std::vector<Contribution> contributions_of(const ConstantPlaces& places,
                                           const AdjointTarget& target,
                                           const std::vector<Expr>& sums);

}  // namespace retrograde::autodiff
