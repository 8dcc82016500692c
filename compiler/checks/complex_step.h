// complex_step.h -- copies a graph of Funcs over complex numbers, for derivatives by a complex step.
//
//   f(x + i h v) = f(x) + i h <f'(x), v> + O(h^2)       (Squire and Trapp, SIAM Review 40, 1998)
//
// Nothing is subtracted, so h can be so small that only rounding error remains. Every floating value of a Func becomes
// two values, its real and its imaginary part. Comparisons, indices and step functions (floor) use the real part, and
// min, max and abs choose by it, so that every branch is that of the original.
//
// An operator must be complex differentiable, and its imaginary part must be computable for tiny imaginary parts. For
// other operators `refused` states the reason.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "frontend/language/func.h"

namespace retrograde::checks {

struct ComplexGraph {
  Func output;  // values: real and imaginary parts alternate; integers have no imaginary part
  // The parameter of the imaginary part of each floating input; unbound.
  std::map<const ir::Symbol*, std::shared_ptr<graph::ParameterContents>> imaginary;
  std::string refused;  // why there is no graph; empty if there is one
};

// The complex version of `output`, a graph in double (widen.h).
ComplexGraph complex_graph(const Func& output);

}  // namespace retrograde::checks
