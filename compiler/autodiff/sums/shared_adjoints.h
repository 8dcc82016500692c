// shared_adjoints.h -- computes the common subexpressions of one stage's contributions once, in a Func of their own.
//
//   h(x, t + 1) = tanh(w(x) h(x, t) + u(x, t))
//   w_adj(x)    += sum over t of h_adj(x, t + 1) tanh'(...) h(x, t)
//   u_adj(x, t) += h_adj(x, t + 1) tanh'(...)
//
// Contributions are gathered over different index sets, so each computes its terms separately: a step with many inputs
// would be recomputed for each input. Here h_adj(x, t + 1) tanh'(...) is the adjoint of an inner value of the step from
// which two or more contributions follow. It becomes a value of the Func h_adj_inner(x, t), over the variables of the
// stage.
//
// Only adjoints are shared. The primal values that a partial reads stay in the expression, where stable_forms.h finds
// them when the gradient is differentiated again. Sharing must save more operations than the memory round trip of the
// values costs, and all that they read must exist over the whole domain.
#pragma once

#include <vector>

#include "autodiff/inversion/access_inversion.h"
#include "autodiff/sweeps/regions.h"
#include "autodiff/sweeps/reverse_sweep.h"

namespace retrograde::autodiff {

struct SharedAdjoints {
  FuncPtr func;                // null: sharing does not pay
  std::vector<Expr> adjoints;  // of the leaves, reading func
};

// `leaves` come from one sweep from `seeds`, over the variables of `domain`. `regions` are those that the primal reads.
SharedAdjoints share_adjoints(const std::string& name, const IterationDomain& domain,
                              const std::vector<LeafAdjoint>& leaves,
                              const std::vector<Expr>& seeds, const Regions& regions);

bool is_bounded_box(const IterationDomain& domain);
// Whether all elements that the values read over the domain exist. An access of the primal may be guarded by a
// condition that does not hold there.
bool reads_what_is_there(const std::vector<Expr>& values, const IterationDomain& domain,
                         const Regions& regions);
// A Func with these values for each point of the domain.
FuncPtr define_over(const IterationDomain& domain, const std::string& name,
                    const std::vector<Expr>& values);

}  // namespace retrograde::autodiff
