// absent_gradients.h -- requested gradients without contributions: they become zeros, with an explanation.
#pragma once

#include "autodiff/report/synthesis_account.h"
#include "autodiff/sweeps/primal.h"

namespace retrograde::autodiff {

// `covered`: Funcs inside of a custom adjoint.
void explain_absent(const Primal& primal, const std::unordered_set<const Symbol*>& covered,
                    SynthesisResult& result, SynthesisAccount& account);

}  // namespace retrograde::autodiff
