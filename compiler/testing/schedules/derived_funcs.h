// derived_funcs.h -- random directives that add Funcs to a program: wrappers, clones, copies of inputs, and updates that
// are factored into partial results.
#pragma once

#include "testing/schedules/draft.h"

namespace retrograde::fuzz {

// Draws the directives and replaces the draft's Funcs by those that exist then. If the directives are illegal together,
// none remains.
void derive_funcs(Draft& draft, const RandomProgram& program);

}  // namespace retrograde::fuzz
