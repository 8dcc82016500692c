// pilot.h -- how much smoothness the noise asks for, by a short run of the optimization itself.
#pragma once

#include "evaluator.h"
#include "options.h"
#include "prepare.h"

namespace burst {

// Sets the smoothness of what was prepared, and of the evaluator: some steps with little of it explain all of the
// frames but their noise, which then says how much there should be. Nothing changes where there are too few
// frames, the picture does not move, or --lambda is given. Its time is added to what was prepared.
void choose_smoothness(const Options& options, const Burst& burst, Prepared& prepared,
                       Evaluator<float>& evaluator);

}  // namespace burst
