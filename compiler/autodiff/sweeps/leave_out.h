// leave_out -- gradients that nobody asked for by name may not stand in the way of the others.
//
// Without `wrt` everything has a gradient, also a Param that only happens to be a float. Where that
// cannot be, it is left out, and says so when it is looked up.
#pragma once

#include "autodiff/sweeps/synthesis.h"

namespace retrograde::autodiff {

// As synthesize_adjoints or, with a budget for checkpoints, synthesize_folded. What these refuse,
// this refuses, unless it is for a scalar parameter that was not requested.
SynthesisResult synthesize_what_can_be(const Seed& seed, const SynthesisOptions& options);

}  // namespace retrograde::autodiff
