// vector_chains.h -- how many vectors a long body computes side by side.
//
//   for i: vector of way = e / (b + sqrt(b * b - bend * e)), ...   one chain of divisions and roots
//
// A processor looks a few hundred instructions ahead. In a shorter body it overlaps iterations; in a longer one it waits
// for the longest chain of operations, each of which needs the one before. Vectors of two or four registers are as many
// independent chains side by side: rays through six lenses take 1.6 ms with two and 1.3 ms with four, instead of 2.4 ms.
#pragma once

#include "graph/function.h"

namespace retrograde::autoschedule {

// 1, 2 or 4 registers for each vector of a pure definition along its first dimension.
int vectors_side_by_side(const FuncContents& f);

}  // namespace retrograde::autoschedule
