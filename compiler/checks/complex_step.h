// The same graph of Funcs over complex numbers: derivatives by a step into the imaginary direction.
//
//   f(x + i h v) = f(x) + i h <f'(x), v> + O(h^2)       (Squire and Trapp, SIAM Review 40, 1998)
//
// There is no subtraction, so that h may be so small that the error is rounding alone. Every
// floating value of a Func becomes two, its real and its imaginary part. Comparisons, indices and
// what is constant between its steps (floor) look at the real part, so that the branch is that of
// the original; min, max and abs choose by it.
//
// Not every operator allows it: the function must be complex differentiable and its imaginary part
// computable for tiny imaginary parts. Of the others there is a reason.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "frontend/language/func.h"

namespace retrograde::checks {

struct ComplexGraph {
  Func output;  // values: real and imaginary part in turn; integers alone
  // Behind each floating input: its imaginary part; unbound.
  std::map<const ir::Symbol*, std::shared_ptr<graph::ParameterContents>> imaginary;
  std::string refused;  // why there is no graph; empty when there is one
};

// `output`: of a graph in double (widen.h).
ComplexGraph complex_graph(const Func& output);

}  // namespace retrograde::checks
