// reverse_sweep.h -- reverse accumulation over the expressions of one stage.
//
// Primal:      v_k = phi_k(operands), in the order of the DAG
// Linearised:  dv_k = sum_i (d phi_k / d operand_i) d operand_i
// Transposed:  adj(operand_i) += adj(v_k) * d phi_k / d operand_i, in the opposite order
//
// Every node is visited once, whatever its number of uses, so the cost is linear in the size of the DAG.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "autodiff/sweeps/local_derivative.h"
#include "ir/expr.h"
#include "ir/visit.h"

namespace retrograde::autodiff {

// A leaf that an adjoint reached: a Call of a Func or image, or the Variable of a scalar parameter.
struct LeafAdjoint {
  Expr leaf;
  Expr adjoint;  // in terms of the same variables as the values
};

struct SweepResult {
  std::vector<LeafAdjoint> leaves;  // in a deterministic order
  std::set<std::string> notes;      // operators through which the gradient is zero
};

// Sweeps from `values` with the adjoints `seeds` (undefined: none). `is_wanted` selects the leaves to collect. Throws
// Unsupported on an operator without a rule between a value and a wanted leaf.
SweepResult sweep_reverse(const std::vector<Expr>& values, const std::vector<Expr>& seeds,
                          FunctionRef<bool(const Expr&)> is_wanted, const ValueRanges& ranges);

}  // namespace retrograde::autodiff
