// The stability suite: small programs on extreme inputs, with their true gradients.
//
// A problem is a function of n numbers to one, over a batch: inputs(i, c) is the i-th number of case c, and the
// program's output is f(c). One adjoint, seeded with ones, therefore contains the gradients of all cases, and one
// compiled program covers hundreds of combinations of extremes.
//
// The true gradient comes from Traced numbers, or from a formula if these overflow or cancel too.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "frontend/language/func.h"
#include "stability/traced.h"

namespace retrograde::stability {

using ExactGradient = std::function<Reals(const Reals&)>;

using Build = std::function<Func(const Buffer<float>& inputs)>;

struct Problem {
  std::string name;
  int n;
  Build build;
  std::function<Traced(const std::vector<Traced>&)> value;
  ExactGradient gradient;  // undefined: that of `value`
};
struct Family {
  std::string name;
  std::vector<Problem> problems;
};

Family norms();
Family exponentials();
Family activations();
Family quotients();
Family selections();
Family angles();
Family ill_conditioned();
Family reductions();
Family recurrences();
Family programs();
inline std::vector<Family> all_families() {
  return {norms(),  exponentials(),    activations(), quotients(),   selections(),
          angles(), ill_conditioned(), reductions(),  recurrences(), programs()};
}

// 1 / (1 + exp(-x)).
inline Real logistic(Real x) {
  return x >= 0 ? 1 / (1 + std::exp(-x)) : std::exp(x) / (1 + std::exp(x));
}

// A pointwise problem of a generic f: called with a vector of Exprs, f makes the program; called with Traced numbers,
// the oracle.
template <class F>
Problem pointwise(const std::string& name, int n, F f, const ExactGradient& exact = {}) {
  auto build = [f, n](const Buffer<float>& inputs) {
    Var c("c");
    Func result("f");
    std::vector<Expr> x;
    for (int i = 0; i < n; ++i) x.push_back(inputs(i, c));
    result(c) = f(x);
    return result;
  };
  return {name, n, build, f, exact};
}

}  // namespace retrograde::stability
