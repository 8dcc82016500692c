// slope.h -- decides which of two differing gradients is wrong, by comparing each with differences of its own program.
#pragma once

#include "../kernels/kernel.h"

namespace kernels {

// Returns the largest |<gradient, v> - (L(x + h v) - L(x - h v)) / 2h| over a few sign vectors v, relative to
// |gradient|, the deviation of <gradient, v>. L is the sum of seed * output, the last output of `primal`. The inputs of
// `primal` (seed last) are changed and restored. `gradients` must have run. The two may be the same kernel; its
// gradients are then those at changed inputs. Rounding, and kinks within h, leave some thousandths in float, where h is
// 2^-13, and less in double, where h is 2^-20.
double slope_error(const Kernel& gradients, Kernel& primal, const Halide::Target& target);

}  // namespace kernels
