// factored_program.h -- differentiates the program with costly factors of its sums as Funcs of their own
// (transform/invariant_factors.h).
//
// Primal:      f(x, y) += g(x, r) h(y, r)      with costly g and h, each a Func
// Transposed:  g_adj(x, r) = sum over y of f_adj(x, y) h(y, r)
//              u_adj(x, r) = g_adj(x, r) dg/du
//
// The adjoints of the factors are sums of products. The derivative of g is applied once for each element of g, where
// differentiating the original term applies it for each (x, y, r).
//
// The factors are hoisted in a copy of the graph, which is differentiated. The gradient then reads the user's Funcs
// again, whose values are the same: a directive that the user gives them later has its effect, and a pipeline of the
// output and its gradient computes them once.
#pragma once

#include <map>

#include "autodiff/sweeps/synthesis.h"
#include "transform/invariant_factors.h"

namespace retrograde::autodiff {

using Synthesize = FunctionRef<SynthesisResult(const Seeds&, const SynthesisOptions&)>;

// The graph with its factors hoisted, for these regions of the outputs.
FactoredGraph with_factors(const std::vector<FuncPtr>& outputs,
                           const std::map<const Symbol*, Box>& regions);

// Calls `synthesize` on the factored program. Adjoints are reported as those of the original Funcs.
SynthesisResult synthesize_factored(const Seeds& seeds, const SynthesisOptions& options,
                                    Synthesize synthesize);

}  // namespace retrograde::autodiff
