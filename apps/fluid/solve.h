// solve.h -- (shift + a L) x = b on a rectangle, where L is minus the Laplacian of five points.
//
//   L x = 4 x(i, j) - x(i - 1, j) - x(i + 1, j) - x(i, j - 1) - x(i, j + 1)
//
// Outside of the rectangle x goes on with its border's value (nothing flows through the wall), or,
// across the walls that a velocity is normal to, it is 0 on the wall itself. Shift 1 is a step of
// implicit diffusion; shift 0 the pressure, whose mean is then any, here 0.
#pragma once

#include <retrograde/retrograde.h>

#include <string>

#include "frame_shape.h"

namespace fluid {

// What holds at the two ends of an axis.
enum class Ends : uint8_t {
  Free,  // `samples` cells, walls half a cell beyond the outermost: no slope at the wall
  Zero   // `samples` faces, the first and the last on the walls: 0 there
};

struct Axis {
  int samples;
  Ends ends;
};

struct System {
  retrograde::Func right_side;  // of two variables
  Axis x, y;
  bool shifted;           // shift 1 (diffusion) or 0 (pressure)
  retrograde::Expr rate;  // a
  retrograde::Type scalar;
  std::string name;
};

// By the eigenvectors of L, cosines along free axes and sines along the others: two products with
// a matrix there, a division, and two products back (Buzbee, Golub and Nielson, On direct methods
// for solving Poisson's equations, SIAM Journal on Numerical Analysis 7(4), 1970, section 2; Stam
// solves both systems directly, too). Any size is as good as a power of two.
retrograde::Func solve_directly(const System& system);

// By Jacobi's method from x = b (shift 1) or from 0. The pressure's iterations are accelerated by
// Chebyshev's polynomials (Golub and Varga, Chebyshev semi-iterative methods, Numerische Mathematik
// 3, 1961, section 3) for the waves that so few of them can reach: longer ones are left as they are,
// which would need as many iterations as the grid has cells along a side.
retrograde::Func solve_by_iterations(const System& system, int iterations);

}  // namespace fluid
