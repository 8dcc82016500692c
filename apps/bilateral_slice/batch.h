// batch.h -- --pairs: one look for a folder of photographs, and how well it suits those it did not see.
#pragma once

#include <optional>

#include "look.h"
#include "options.h"

namespace bilateral_slice {

// Photographs are learned from at one small size, one a step, in random order; which are held out, division.h
// says. All are taken in colour where one of them has colours. The output folder receives look.bin, state.bin,
// report.json, its plot, and pictures of a photograph held out. Throws retrograde::UserError.
// With --resume it goes on from state.bin there.
void learn_from_pairs(const Options& options, const std::optional<Look>& start);

}  // namespace bilateral_slice
