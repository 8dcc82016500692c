// fluid_step -- a step of a fluid on a grid: force, diffusion, advection, projection, advection of density, and its
// distance from a target. Gradients: velocity, force and density. Source: J. Stam, Stable Fluids, SIGGRAPH 1999.
#include "operator.h"

namespace kernels {

namespace {

constexpr int iterations = 20;
constexpr float time_step = 0.5f, viscosity = 0.2f;

Func edge(const Func& f, int size) {
  return BoundaryConditions::repeat_edge(f, {{0, size}, {0, size}});
}

// The position from which the fluid at (x, y) comes.
struct Origin {
  Expr u, v;
};
Origin origin(const Var& x, const Var& y, const Expr& vx, const Expr& vy, int size, Func& place) {
  place(x, y) = Tuple(clamp(x - time_step * vx, 0.0f, size - 1.0f),
                      clamp(y - time_step * vy, 0.0f, size - 1.0f));
  return {place(x, y)[0], place(x, y)[1]};
}

// (1 + 4a) diffused - a (its neighbours) = velocity, by Jacobi's method.
Func diffuse(const Func& velocity, int size) {
  Var x("x"), y("y"), c("c");
  Func state = velocity;
  for (int i = 0; i < iterations; i++) {
    Func bounded = edge(state, size), next("diffused");
    Expr neighbours =
        bounded(x + 1, y, c) + bounded(x - 1, y, c) + bounded(x, y + 1, c) + bounded(x, y - 1, c);
    next(x, y, c) = (velocity(x, y, c) + viscosity * neighbours) * (1 / (1 + 4 * viscosity));
    state = next;
  }
  return state;
}

// The pressure whose Laplacian is that divergence, iterated from zero.
Func pressure_of(const Func& divergence, int size) {
  Var x("x"), y("y");
  Func state("pressure");
  state(x, y) = -0.25f * divergence(x, y);
  for (int i = 1; i < iterations; i++) {
    Func bounded = edge(state, size), next("pressure");
    next(x, y) = 0.25f * (bounded(x + 1, y) + bounded(x - 1, y) + bounded(x, y + 1) +
                          bounded(x, y - 1) - divergence(x, y));
    state = next;
  }
  return state;
}

}  // namespace

Kernel fluid_step(const Setup& setup) {
  const int size = setup.size(256, 21);
  const Buffer<real> velocity = make_waves({size, size, 2}, -3, 3, 31);
  const Buffer<real> force = make_waves({size, size, 2}, -2, 2, 53);
  const Buffer<real> density = make_values({size, size}, 0.5f, 1.5f);
  const Buffer<real> target = make_waves({size, size}, 0.5f, 1.5f, 41);
  Var x("x"), y("y"), c("c");
  Func driven("driven"), moved("moved"), divergence("divergence"), place("place");
  driven(x, y, c) = velocity(x, y, c) + time_step * force(x, y, c);
  Func diffused = diffuse(driven, size);
  const Origin from = origin(x, y, diffused(x, y, 0), diffused(x, y, 1), size, place);
  moved(x, y, c) = bilinear(diffused, from.u, from.v, size, size, {c});
  Func bounded = edge(moved, size);
  divergence(x, y) = 0.5f * (bounded(x + 1, y, 0) - bounded(x - 1, y, 0) + bounded(x, y + 1, 1) -
                             bounded(x, y - 1, 1));
  Func pressure = edge(pressure_of(divergence, size), size);
  Func final_x("final_x"), final_y("final_y"), carried("carried"), loss("loss"), end("end");
  final_x(x, y) = moved(x, y, 0) - 0.5f * (pressure(x + 1, y) - pressure(x - 1, y));
  final_y(x, y) = moved(x, y, 1) - 0.5f * (pressure(x, y + 1) - pressure(x, y - 1));
  const Origin before = origin(x, y, final_x(x, y), final_y(x, y), size, end);
  carried(x, y) = bilinear(density, before.u, before.v, size, size, {});
  RDom r(0, size, 0, size);
  loss() = real(0);
  loss() += pow(carried(r.x, r.y) - target(r.x, r.y), 2);
  const double cells = static_cast<double>(size) * size;
  return gradients_of(setup, loss, {}, {velocity, force, density},
                      cells * (iterations * 3 * 15 + 200), {target});
}

}  // namespace kernels
