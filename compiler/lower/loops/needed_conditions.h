// needed_conditions.h -- finds conditions that must hold for an iteration of a loop to have any effect.
//
//   for (yi, 0, 8) {                             n - 32*xo > 0
//     f[...] = ...                     <- fills memory of the iteration
//     for (xi, 0, 32) {
//       if (32*xo + xi < n) { out[...] = f[...] }
//     }
//   }
//
// The guard of an inner loop fails in all iterations if it fails in the most favourable one, so inner variables are
// replaced by the end of their range. Where the condition fails, the statements that fill memory for the guarded
// statement need not run either.
#pragma once

#include <vector>

#include "ir/expr.h"
#include "ir/sum.h"

namespace retrograde::lower {

// Sums that are at least 0 wherever the loop body does more than fill memory allocated inside it; empty if it fills
// none. They read no memory and mention no names bound in the body.
std::vector<Sum> needed_conditions(const For& loop);

}  // namespace retrograde::lower
