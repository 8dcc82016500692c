// running_sums.h -- splits a sum of many adjoints into running sums of a few each.
//
//   b_adj = a1_adj + a2_adj + ... + a20_adj    =>    s1 = a1_adj + ... + a4_adj
//                                                     s2 = s1 + a5_adj + ... + a8_adj
//                                                     ...
//                                                     b_adj = s4 + a17_adj + ... + a20_adj
//
// A Func that every step of an iteration reads, as the right-hand side of a linear system, gets a contribution from
// each step. A single sum would keep the adjoints of all steps alive until the last one is computed; with running sums
// few are alive at once. Terms are added in the order in which the adjoints are computed, so pointwise results keep the
// same bits. Each sum has a few terms because each adds the memory round trip of one more Func.
//
// Source: accumulation of adjoints in the reverse sweep of a tape (Griewank and Walther, Evaluating Derivatives, SIAM
// 2008, section 3.2), which adds each adjoint as soon as it is computed; ours adds groups.
#pragma once

#include <set>
#include <vector>

#include "autodiff/sums/accumulation.h"

namespace retrograde::autodiff {

// The adjoints that a contribution reads.
std::set<const Symbol*> sources_of(const Contribution& contribution);

// Splits the contributions into groups, in order. One group if the contributions come from few adjoints.
std::vector<std::vector<Contribution>> running_groups(
    const std::vector<Contribution>& contributions);

}  // namespace retrograde::autodiff
