// What the contributions of one stage have in common, in a Func of its own.
//
//   h(x, t + 1) = tanh(w(x) h(x, t) + u(x, t))
//   w_adj(x)    += sum over t of h_adj(x, t + 1) tanh'(...) h(x, t)
//   u_adj(x, t) += h_adj(x, t + 1) tanh'(...)
//
// Contributions are gathered at places of their own, so that each computes its terms by itself: a
// step with many inputs would be computed again for every one. Here h_adj(x, t + 1) tanh'(...), the
// adjoint of an inner value of the step from which two contributions or more go on, becomes a value
// of h_adj_inner(x, t), over the variables of the stage.
//
// Only adjoints: what a partial reads of the primal stays where stable forms (stable_forms.h) find
// it when the gradient is differentiated. Only where that saves more operations than it takes to
// bring the values to memory and back, and what is read over the whole domain is there.
#pragma once

#include <vector>

#include "autodiff/inversion/access_inversion.h"
#include "autodiff/sweeps/regions.h"
#include "autodiff/sweeps/reverse_sweep.h"

namespace retrograde::autodiff {

struct SharedAdjoints {
  FuncPtr func;                // null: nothing is worth it
  std::vector<Expr> adjoints;  // of the leaves, with reads of func
};

// `leaves`: of one sweep from `seeds`, over the variables of `domain`. `regions`: of what the
// primal reads.
SharedAdjoints share_adjoints(const std::string& name, const IterationDomain& domain,
                              const std::vector<LeafAdjoint>& leaves,
                              const std::vector<Expr>& seeds, const Regions& regions);

}  // namespace retrograde::autodiff
