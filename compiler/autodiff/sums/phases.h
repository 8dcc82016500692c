// phases.h -- splits a sum whose indices divide by a stride into one sum for each phase of the stride.
//
//   f(x) += a(2 * x + r) * w(r)                                   a strided convolution, and its gradient by a:
//
//   a_adj(y) += f_adj(y / 2 - rho) * w(y % 2 + 2 * rho)     =>    a_adj_phases(q, p) += f_adj(q - rho) * w(p + 2 * rho)
//                                                                 a_adj(y) = a_adj_phases(y / 2, y % 2)
//
// Each lane of a vector of y would divide and take a remainder, so both reads would be gathers. Vectors of q have one
// phase p: the first read is dense, the second one the same for all lanes, and the number of terms depends on p only.
// A long stride, as the hop of a windowed transform, has vectors along the phase: there w(p + 128 * rho) is dense.
//
// Method: with the period P of all divisions in y (analysis/periods.h), y = P * q + p - offset with 0 <= p < P, and no
// division contains q. Only the first dimension is split: its neighbours are the lanes of vectors. In others a division
// is the same for all lanes.
// Not done: contributions that reach an element at most once, which need no loop (lower/interleave_vectors splits
// them); few blocks of a short period, which fill half a vector.
// Source: polyphase decomposition (Vaidyanathan, Multirate Systems and Filter Banks, 1993, chapter 4).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "autodiff/sums/accumulation.h"

namespace retrograde::autodiff {

// Contributions to elements that are numbered by quotient and phase.
struct PhasedSum {
  int64_t period = 1;
  AdjointTarget target;  // has one dimension more
  std::vector<Contribution> contributions;
  std::vector<Expr> place;  // of an element of the original target
};

// Removes the contributions that are such sums, one PhasedSum for each period.
std::vector<PhasedSum> take_phased_sums(const AdjointTarget& target,
                                        std::vector<Contribution>& contributions);

}  // namespace retrograde::autodiff
