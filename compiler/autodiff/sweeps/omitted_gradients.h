// omitted_gradients.h -- drops unrequested gradients that cannot be built.
//
// Without `wrt` every input gets a gradient, even a scalar Param that only happens to be a float. If the gradient by
// such a scalar is unsupported, it is left out, and looking it up gives the reason.
#pragma once

#include "autodiff/sweeps/synthesis.h"

namespace retrograde::autodiff {

// Calls synthesize_adjoints or, with a budget for checkpoints, synthesize_folded. Throws what they throw, unless the
// cause is a scalar parameter that was not requested.
SynthesisResult synthesize_supported(const Seeds& seeds, const SynthesisOptions& options);

}  // namespace retrograde::autodiff
