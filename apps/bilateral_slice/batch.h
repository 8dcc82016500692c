// batch.h -- --pairs: one look for a folder of photographs, and how well it suits those it did not see.
#pragma once

#include "options.h"

namespace bilateral_slice {

// Photographs are learned from at one small size, one a step, in random order; every fifth is held out.
// The output folder receives look.bin, report.json, its plot, and pictures of a photograph held out.
// Throws retrograde::UserError.
void learn_from_pairs(const Options& options);

}  // namespace bilateral_slice
