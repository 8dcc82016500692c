// output_order -- outputs as soon as what they read is there.
//
//   temp; out_1 reads temp; other; out_2 reads other      not      temp; other; out_1; out_2
//
// An output's memory is its caller's, whenever it is computed; what only the output reads is free
// after it, and still in the caches before.
#pragma once

#include "lower/program.h"

namespace retrograde::lower {

void compute_outputs_early(Program& program);

}  // namespace retrograde::lower
