// complex_step.h -- rewrites a graph of Funcs over complex numbers, for derivatives by the complex-step method.
//
//   f(x + i h v) = f(x) + i h <f'(x), v> + O(h^2)       (Squire and Trapp, SIAM Review 40, 1998)
//
// There is no subtraction, so h may be so small that the error is rounding alone. Every floating-point value of a Func
// becomes two, its real and its imaginary part. Comparisons, indices and step functions (floor) use the real part, so
// the original branches are taken; min, max and abs choose by it.
//
// An operator is supported if it is complex differentiable and its imaginary part can be computed for tiny imaginary
// parts. For other operators the graph is refused with a reason.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "frontend/language/func.h"

namespace retrograde::checks {

struct ComplexGraph {
  Func output;  // values: alternating real and imaginary parts; integers have no imaginary part
  // The imaginary part of each floating-point input; unbound.
  std::map<const ir::Symbol*, std::shared_ptr<graph::ParameterContents>> imaginary;
  std::string refused;  // reason if there is no graph; else empty
};

// `output` belongs to a graph in double (widen.h).
ComplexGraph complex_graph(const Func& output);

}  // namespace retrograde::checks
