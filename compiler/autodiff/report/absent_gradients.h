// Gradients that were asked for and that nothing contributes to: zeros that may be looked up, and
// why they are.
#pragma once

#include "autodiff/report/synthesis_account.h"
#include "autodiff/sweeps/active_symbols.h"

namespace retrograde::ir {

struct AbsentQuery {
  const FuncPtr& output;
  const std::vector<FuncPtr>& order;
  const SynthesisOptions& options;
  const ActiveSymbols& active;
  const std::unordered_set<const Symbol*>& covered;  // inside of a custom adjoint that was used
  FunctionRef<AdjointTarget(const Symbol*)> target_of;
};
void explain_absent(const AbsentQuery& query, SynthesisResult& result, SynthesisAccount& account);

}  // namespace retrograde::ir
