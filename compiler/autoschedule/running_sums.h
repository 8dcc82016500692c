// running_sums.h -- sums of many adjoints by few of them (autodiff/sums/running_sums.h).
//
//   s1 = a1_adj + ... + a4_adj;  s2 = s1 + a5_adj + ... + a8_adj;  b_adj = s2 + ...
//
// At root, each lets what it reads go. Inlined, or computed in the loops of the next, all would be
// kept until the last.
#pragma once

#include <vector>

#include "graph/function.h"

namespace retrograde::autoschedule {

// What of it goes on in its only reader, at the same elements.
bool is_running_sum(const FuncContents& f, const FuncContents& reader);
// The adjoints that it adds up.
std::vector<FuncPtr> summed_adjoints(const FuncContents& f);
// Of these, so that it is worth a way to memory.
inline constexpr size_t least_summed = 3;

}  // namespace retrograde::autoschedule
