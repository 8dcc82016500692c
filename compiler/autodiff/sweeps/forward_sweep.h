// forward_sweep.h -- forward accumulation over the expressions of one stage.
//
// Primal:      v_k = phi_k(operands), in the order of the DAG
// Linearised:  dv_k = sum_i (d phi_k / d operand_i) d operand_i, in the same order
//
// Every node is visited once, so the cost is linear in the size of the DAG. The partials, their conventions and their
// strong zeros are those of the reverse sweep, so the two modes are transposes of each other at every point, kinks
// included.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "autodiff/sweeps/local_derivative.h"

namespace retrograde::autodiff {

struct ForwardResult {
  std::vector<Expr> tangents;   // for each value, of its adjoint type; undefined: identically zero
  bool moves = false;           // a value depends on a leaf that has a tangent
  std::set<std::string> notes;  // operators through which the derivative is zero
  AdjointTraits traits;         // of all tangents
};

// `tangent_of` returns the tangent of a leaf; undefined if it has none. The tangent of undef is undef, so a tangent is
// stored exactly where its value is. Throws Unsupported on an operator without a rule between a value and a leaf with a
// tangent.
ForwardResult sweep_forward(const std::vector<Expr>& values,
                            FunctionRef<Expr(const Expr&)> tangent_of, const ValueRanges& ranges);

}  // namespace retrograde::autodiff
