// invariant_factors.h -- loop-invariant code motion out of sums: a costly factor of a term that depends on fewer
// variables than the term becomes a Func of its own.
//
//   counts(a, b) += exp(g(a, r)) * exp(h(b, r))   =>   counts_factor(a, r) = exp(g(a, r))
//                                                      counts_factor$1(b, r) = exp(h(b, r))
//                                                      counts(a, b) += counts_factor(a, r) * counts_factor$1(b, r)
//
// Each exponential runs once for each of its arguments, not for each (a, b, r). What remains is a matrix product, and
// so is the adjoint of each factor.
//
// 1. The stage is an update f(x, ...) = f(x, ...) + term, or - term, over pure variables x, ... and reduction
//    variables, without a predicate. Its Func is the user's and has no directives.
// 2. The factor depends on some of the reduction variables, but not on all variables of the stage. What depends on pure
//    variables alone leaves the loops of the reduction in code generation; it is a factor only if it is a quotient of many
//    terms, such as a mean: otherwise the adjoints of both of its operands are sums over all terms.
// 3. It has no effect, and calls no C function that may have one. It does not lie in an arm of an if_then_else, which
//    moves as a whole or stays: over all values of its variables it reads what the term reads, and no more.
// 4. The sizes of its dimensions are known, and all factors of a Func take at most 64 MB.
// 5. The operations saved cost clearly more than writing and reading the factor. Cheap ones are no factors, but quotients
//    are.
//
// Values keep their bits: the factor is the same expression in the same type, and no sum changes its order. A product
// that is added stays where it is, because code generation contracts it with the addition.
//
// Not done: factors of scatters, of other reductions and of pure definitions; sizes known at run time only; tangents.
// Source: A. Aho, M. Lam, R. Sethi and J. Ullman, Compilers (2006), section 9.5, for code motion; the factor is stored
// for all values of its variables instead of moved in front of one loop.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "graph/function.h"
#include "ir/visit.h"
#include "transform/factored_graph.h"

namespace retrograde::transform {

// How many values a pure or reduction variable of a stage takes; nullopt: not known.
using ValuesOfVariable = FunctionRef<std::optional<int64_t>(const FuncContents& f, int stage,
                                                            const std::string& variable)>;

// Whether a Func was made for such a factor.
bool is_invariant_factor(const FuncContents& f);

// `outputs`: of a graph whose wrappers have been applied. A factor that the graph has already is not made again.
FactoredGraph hoist_invariant_factors(const std::vector<FuncPtr>& outputs, ValuesOfVariable values);

// The outputs of the graph with its factors hoisted, and its values that depend on coarse grids (coarse_values.h); sizes
// are those that the outputs and images are known or estimated to have.
std::vector<FuncPtr> with_invariant_factors(const std::vector<FuncPtr>& outputs,
                                            SumOrder order = SumOrder::Kept);

}  // namespace retrograde::transform
