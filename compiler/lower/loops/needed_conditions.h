// needed_conditions.h -- what must hold for an iteration of a loop to do anything.
//
//   for (yi, 0, 8) {                             n - 32*xo > 0
//     f[...] = ...                     <- fills memory of the iteration
//     for (xi, 0, 32) {
//       if (32*xo + xi < n) { out[...] = f[...] }
//     }
//   }
//
// A guard of an inner loop holds in none of its iterations where it does not hold in the one that is
// best for it: inner variables are replaced by the end of their range. Where that fails, what fills
// memory for the guarded statement need not run.
#pragma once

#include <vector>

#include "ir/expr.h"
#include "ir/sum.h"

namespace retrograde::lower {

// Sums that are at least 0 wherever the body of the loop does more than to fill memory of its own;
// none where it fills nothing. They read no memory, and mention nothing that is bound in the body.
std::vector<Sum> needed_conditions(const For& loop);

}  // namespace retrograde::lower
