// batch.h -- --pairs: learns one look from a folder of photographs, and measures it on photographs held out.
#pragma once

#include <optional>

#include "look.h"
#include "options.h"

namespace bilateral_slice {

// Training uses all photographs at one small size, one per step, in random order; division.h says which are held out.
// All are in colour if any of them is. The output folder receives look.bin, state.bin, report.json, its plot, and
// pictures of a held-out photograph. With --resume, training continues from the state.bin there. Throws
// retrograde::UserError.
void learn_from_pairs(const Options& options, const std::optional<Look>& start);

}  // namespace bilateral_slice
