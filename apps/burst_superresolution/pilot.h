// pilot.h -- chooses the smoothness from the noise, measured by a short run of the optimization itself.
#pragma once

#include "evaluator.h"
#include "options.h"
#include "prepare.h"

namespace burst {

// Sets the smoothness of `prepared` and of the evaluator. A few steps with little smoothness explain everything in the
// frames except their noise; the noise then determines the weights. Nothing changes if there are too few frames, the
// picture does not move, or --lambda is given. Its time is added to that of `prepared`.
void choose_smoothness(const Options& options, const Burst& burst, Prepared& prepared,
                       Evaluator<float>& evaluator);

}  // namespace burst
