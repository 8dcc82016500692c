// What synthesis knows of the program that it differentiates: its Funcs, what is read of them, which
// of them lie between what is asked for and the output.
#pragma once

#include <vector>

#include "autodiff/rules/value_range.h"
#include "autodiff/sweeps/active_symbols.h"
#include "autodiff/sweeps/reverse_sweep.h"

namespace retrograde::autodiff {

struct Primal {
  Primal(const Seed& seed, const SynthesisOptions& options);

  const Seed& seed;
  const SynthesisOptions& options;
  std::vector<FuncPtr> order;  // producers first
  Regions regions;
  ValueRanges ranges;
  ActiveSymbols active;

  AdjointTarget target_of(const Symbol* symbol) const;
  // Whether it is asked for by name.
  bool is_named(const Symbol* symbol) const;
  // The adjoint of each value where the stage writes; undefined for values that are no floats. A
  // place that depends on data may lie outside of all that is read: 0 there.
  std::vector<Expr> adjoints_at_write(const FuncContents& f, int stage,
                                      const FuncPtr& adjoint) const;
  // Down to the leaves that get an adjoint, `except` one.
  SweepResult sweep(const std::vector<Expr>& values, const std::vector<Expr>& seeds,
                    const Symbol* except = nullptr) const;
};

}  // namespace retrograde::autodiff
