// trainer_state.h -- a trainer in the file behind --resume, and back.
#pragma once

#include <string>

#include "common/state.h"
#include "trainer.h"

namespace bilateral_slice {

// "grid,mix,curve", or fewer.
std::string names_of(const Groups& groups);

// What moves, with its moments, what does not, and the number of steps.
apps::State state_of(const Trainer& trainer);
void restore(Trainer& trainer, const apps::State& state);

// Throws retrograde::UserError where a run of other groups or channels wrote it. Other sizes are found by restore.
void require_same_run(const apps::State& state, const Shape& shape, const Groups& moves);

}  // namespace bilateral_slice
