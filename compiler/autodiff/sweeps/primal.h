// primal.h -- facts about the program being differentiated.
//
// These are its Funcs, the regions read of them, and which of them lie between the requested inputs and the outputs.
#pragma once

#include <vector>

#include "autodiff/rules/value_range.h"
#include "autodiff/sweeps/active_symbols.h"
#include "autodiff/sweeps/reverse_sweep.h"

namespace retrograde::autodiff {

struct Primal {
  Primal(const Seeds& seeds, const SynthesisOptions& options);

  const Seeds& seeds;
  const SynthesisOptions& options;
  std::vector<FuncPtr> outputs;
  std::vector<FuncPtr> order;  // producers first
  Regions regions;
  ValueRanges ranges;
  ActiveSymbols active;

  AdjointTarget target_of(const Symbol* symbol) const;
  // Whether its gradient was requested by name.
  bool is_named(const Symbol* symbol) const;
  // The adjoint of each value at the place that the stage writes; undefined for values that are no floats. A
  // data-dependent place may lie outside of all regions read; the adjoint is 0 there.
  std::vector<Expr> adjoints_at_write(const FuncContents& f, int stage,
                                      const FuncPtr& adjoint) const;
  // Sweeps down to the leaves that get an adjoint, without `except`.
  SweepResult sweep(const std::vector<Expr>& values, const std::vector<Expr>& seeds,
                    const Symbol* except = nullptr) const;
};

}  // namespace retrograde::autodiff
