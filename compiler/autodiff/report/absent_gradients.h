// Gradients that were asked for and that nothing contributes to: zeros that may be looked up, and
// why they are.
#pragma once

#include "autodiff/report/synthesis_account.h"
#include "autodiff/sweeps/primal.h"

namespace retrograde::autodiff {

// `covered`: inside of a custom adjoint that was used.
void explain_absent(const Primal& primal, const std::unordered_set<const Symbol*>& covered,
                    SynthesisResult& result, SynthesisAccount& account);

}  // namespace retrograde::autodiff
