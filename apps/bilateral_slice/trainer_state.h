// trainer_state.h -- saves a trainer to the file behind --resume, and restores it.
#pragma once

#include <string>

#include "common/state.h"
#include "trainer.h"

namespace bilateral_slice {

// "grid,mix,curve", or a subset.
std::string names_of(const Groups& groups);

// Contains the groups that move, with their moments, the others, and the number of steps.
apps::State state_of(const Trainer& trainer);
void restore(Trainer& trainer, const apps::State& state);

// Throws retrograde::UserError if the state comes from a run with other groups or channels. `restore` checks the sizes.
void require_same_run(const apps::State& state, const Shape& shape, const Groups& moves);

}  // namespace bilateral_slice
