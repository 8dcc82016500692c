// active_symbols.h -- which Funcs and parameters lie between what is asked for and the output: the
// ones that get an adjoint.
#pragma once

#include <unordered_set>
#include <vector>

#include "autodiff/sweeps/synthesis.h"

namespace retrograde::autodiff {

// Of a symbol that is an image or scalar parameter; else null.
const ParameterContents* as_parameter(const Symbol* symbol);
// What a leaf of an expression refers to; null for variables that are no parameter.
Symbol* symbol_of(const Expr& leaf);

class ActiveSymbols {
 public:
  // `order`: all that the output depends on, producers first.
  ActiveSymbols(const FuncPtr& output, const std::vector<FuncPtr>& order,
                const SynthesisOptions& options);

  bool is_requested(const Symbol* symbol) const;
  bool contains(const Symbol* symbol) const { return active_.contains(symbol); }
  bool contains(const Expr& leaf) const;
  // Whether derivatives go on from a Func to something wanted.
  bool is_passed_by(const Symbol* f) const { return passing_.contains(f); }
  // Whether the output is the same for all values of the Func (rules/invariance.h).
  bool cancels(const Symbol* f) const { return cancelling_.contains(f); }

 private:
  bool passes_on(const FuncContents& f) const;
  bool reads_active(const Definition& definition) const;

  const SynthesisOptions& options_;
  std::unordered_set<const Symbol*> cancelling_, active_, passing_;
};

}  // namespace retrograde::autodiff
