// slope.h -- whose gradient is wrong, when two differ: each against what its own program says.
#pragma once

#include "../kernels/kernel.h"

namespace kernels {

// The largest |<gradient, v> - (L(x + h v) - L(x - h v)) / 2h| over a few directions v of signs,
// relative to |gradient|, the deviation of <gradient, v>. L is the sum of seed * output, the last
// that `primal` computes (its inputs, the seed last, are moved and put back); `gradients` has run.
// Both may be the same, which then holds the gradients at moved inputs. Rounding and kinks within h
// leave some thousandths in float, where it is 2^-13, and less in double, where it is 2^-20.
double slope_error(const Kernel& gradients, Kernel& primal, const Halide::Target& target);

}  // namespace kernels
