// solve.h -- solves (shift + a L) x = b on a rectangle, where L is minus the five-point Laplacian.
//
//   L x = 4 x(i, j) - x(i - 1, j) - x(i + 1, j) - x(i, j - 1) - x(i, j + 1)
//
// Outside the rectangle, x continues with its border value (nothing flows through the wall). Across walls to which a
// velocity is normal, x is 0 on the wall itself. Shift 1 is a step of implicit diffusion. Shift 0 is the pressure
// equation, whose solution has an arbitrary mean, here 0.
#pragma once

#include <retrograde/retrograde.h>

#include <string>

#include "frame_shape.h"

namespace fluid {

// The boundary condition at both ends of an axis.
enum class Ends : uint8_t {
  Free,  // `samples` cells, with walls half a cell beyond the outermost; zero slope at the wall
  Zero   // `samples` faces, the first and the last on the walls; zero there
};

struct Axis {
  int samples;
  Ends ends;
};

struct System {
  retrograde::Func right_side;  // of two dimensions
  Axis x, y;
  bool shifted;           // shift 1 (diffusion) or 0 (pressure)
  retrograde::Expr rate;  // a
  retrograde::Type scalar;
  std::string name;
};

// Uses the eigenvectors of L, which are cosines along free axes and sines along the others: two matrix products, a
// division, and two products back (Buzbee, Golub and Nielson, On direct methods for solving Poisson's equations, SIAM
// Journal on Numerical Analysis 7(4), 1970, section 2; Stam solves both systems directly too). No size is preferred,
// unlike in FFTs.
retrograde::Func solve_directly(const System& system);

// Uses Jacobi's method, from x = b (shift 1) or from 0. For the pressure, Chebyshev polynomials (Golub and Varga,
// Chebyshev semi-iterative methods, Numerische Mathematik 3, 1961, section 3) accelerate the convergence of waves that
// the number of iterations can reduce. Longer waves would need as many iterations as the grid has cells along a side,
// and are not reduced.
retrograde::Func solve_by_iterations(const System& system, int iterations);

}  // namespace fluid
