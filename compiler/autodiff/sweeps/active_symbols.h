// active_symbols.h -- finds the Funcs and parameters that need an adjoint.
//
// These are the symbols on a path from a requested input to an output.
#pragma once

#include <unordered_set>
#include <vector>

#include "autodiff/sweeps/synthesis.h"

namespace retrograde::autodiff {

// The contents of a symbol that is an image or scalar parameter; null for other symbols.
const ParameterContents* as_parameter(const Symbol* symbol);
// The symbol that a leaf of an expression refers to; null for variables that are no parameter.
Symbol* symbol_of(const Expr& leaf);

class ActiveSymbols {
 public:
  // `order` has all Funcs that the outputs depend on, producers first.
  ActiveSymbols(const std::vector<FuncPtr>& outputs, const std::vector<FuncPtr>& order,
                const SynthesisOptions& options);

  bool is_requested(const Symbol* symbol) const;
  bool contains(const Symbol* symbol) const { return active_.contains(symbol); }
  bool contains(const Expr& leaf) const;
  // Whether derivatives pass through the Func to a wanted input.
  bool is_passed_by(const Symbol* f) const { return passing_.contains(f); }
  // Whether the outputs do not depend on the values of the Func (rules/invariance.h).
  bool cancels(const Symbol* f) const { return cancelling_.contains(f); }

 private:
  bool passes_on(const FuncContents& f) const;
  bool reads_active(const Definition& definition) const;

  const SynthesisOptions& options_;
  std::unordered_set<const Symbol*> cancelling_, active_, passing_;
};

}  // namespace retrograde::autodiff
