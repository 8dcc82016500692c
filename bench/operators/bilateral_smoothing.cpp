// bilateral_smoothing -- smooths values in a bilateral grid where confidence is low, by 30 steps of Jacobi's method.
// Gradients: values, confidences and strength. Source: the problem of Barron and Poole, The Fast Bilateral Solver, ECCV
// 2016, section 2.
#include "operator.h"

namespace kernels {

Kernel bilateral_smoothing(const Setup& setup) {
  const int side = setup.size(128, 11), depth = setup.size(32, 5), iterations = 30;
  const Buffer<real> values = make_noise({side, side, depth}, 1);
  const Buffer<real> confidence = make_values({side, side, depth}, 0, 1);
  Buffer<real> strength(std::vector<int>{1});
  strength.fill(0.8f);
  Var x("x"), y("y"), z("z");
  Func weight("weight"), state("state");
  weight(x, y, z) = 1 / (confidence(x, y, z) + 6 * strength(Expr(0)));
  state(x, y, z) = values(x, y, z);
  for (int i = 0; i < iterations; i++) {
    Func f = BoundaryConditions::repeat_edge(state, {{0, side}, {0, side}, {0, depth}});
    Func next("state");
    Expr around = f(x + 1, y, z) + f(x - 1, y, z) + f(x, y + 1, z) + f(x, y - 1, z) +
                  f(x, y, z + 1) + f(x, y, z - 1);
    next(x, y, z) =
        (confidence(x, y, z) * values(x, y, z) + strength(Expr(0)) * around) * weight(x, y, z);
    state = next;
  }
  const double cells = static_cast<double>(side) * side * depth;
  return gradients_of(setup, state, {side, side, depth}, {values, confidence, strength},
                      30.0 * iterations * cells);
}

}  // namespace kernels
