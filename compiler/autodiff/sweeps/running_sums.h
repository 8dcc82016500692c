// A sum of many adjoints as running sums, each of a few of them.
//
//   b_adj = a1_adj + a2_adj + ... + a20_adj    =>    s1 = a1_adj + ... + a4_adj
//                                                    s2 = s1 + a5_adj + ... + a8_adj
//                                                    ...
//                                                    b_adj = s4 + a17_adj + ... + a20_adj
//
// What every step of an iteration reads, as the right-hand side of a linear system, gets a
// contribution from each. One sum of all would hold the adjoints of all steps until the last one is
// there; of running sums few are alive at once. The terms are added in the same order, that in which
// the adjoints are made, so that the result has the same bits where it is pointwise. A few terms a
// sum: each is a way of one more Func to memory and back.
//
// Source: accumulation of adjoints in the reverse sweep of a tape (Griewank and Walther, Evaluating
// Derivatives, SIAM 2008, section 3.2), which adds each when it is made; ours by groups.
#pragma once

#include <vector>

#include "autodiff/sweeps/accumulation.h"

namespace retrograde::autodiff {

// In their order; one group, where the contributions come from few adjoints.
std::vector<std::vector<Contribution>> running_groups(
    const std::vector<Contribution>& contributions);

}  // namespace retrograde::autodiff
