// shared_terms.h -- computes what a stage contributes to several sums once, in a Func of its own.
//
//   ray(i) = g(before(i), bend(), gap())
//
//   bend_adj()   += a(i)               ray_adj_terms(i) = {a(i), b(i), c(i)}
//   gap_adj()    += b(i)          =>   bend_adj()   += ray_adj_terms(i)[0]
//   before_adj(i) = c(i)               gap_adj()    += ray_adj_terms(i)[1]
//                                      before_adj(i) = ray_adj_terms(i)[2]
//
// A sum over many iterations has loops of its own, and so has the adjoint of what each iteration reads for itself. Each
// of them computes the values of the stage and their partials again, which is most of the work of a long scalar program
// with parameters. Here they read their terms instead. The terms are those that the sums would compute, rounded once.
//
// Only definitions without reduction variables share terms, and only if that saves more operations than the memory
// round trips of the terms cost. Terms at data-dependent indices stay where they are scattered.
#pragma once

#include <string>
#include <vector>

#include "autodiff/sums/shared_adjoints.h"

namespace retrograde::autodiff {

// `leaves` come from one sweep over the values of a pure definition, over the variables of `domain`. `regions` are
// those that the primal reads.
SharedAdjoints share_terms(const std::string& name, const IterationDomain& domain,
                           const std::vector<LeafAdjoint>& leaves, const Regions& regions);

}  // namespace retrograde::autodiff
