// simulation.cpp -- see simulation.h.
#include "simulation.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace fluid {

using retrograde::Buffer;
using retrograde::Pipeline;
using retrograde::Realization;

template <typename T>
State<T>::State(const FrameShape& shape)
    : x(shape.width + 1, shape.height),
      y(shape.width, shape.height + 1),
      density(shape.width, shape.height) {
  fill(0);
}

template <typename T>
void State<T>::copy_from(const State& other) {
  const auto copy = [](Buffer<T>& to, const Buffer<T>& from) {
    std::copy_n(from.data(), from.number_of_elements(), to.data());
  };
  copy(x, other.x);
  copy(y, other.y);
  copy(density, other.density);
}

template <typename T>
void State<T>::fill(T value) {
  x.fill(value);
  y.fill(value);
  density.fill(value);
}

// The vortex is the curl of a stream function that is 0 on the walls, by differences between the corners of cells. So
// it has no divergence and does not flow through walls.
template <typename T>
State<T> start_state(const Scene& scene) {
  const int width = scene.shape.width, height = scene.shape.height,
            side = scene.shape.cells_per_unit();
  State<T> state(scene.shape);
  std::transform(scene.start.begin(), scene.start.end(), state.density.data(),
                 [](float d) { return static_cast<T>(d); });
  const auto stream = [&](int i, int j) {
    if (i == 0 || i == width || j == 0 || j == height)
      return 0.0;  // exact, unlike a rounded sine of pi
    return scene.swirl / std::numbers::pi * std::sin(std::numbers::pi * i / width) *
           std::sin(std::numbers::pi * j / height) * side;
  };
  for (int j = 0; j < height; ++j) {
    for (int i = 0; i <= width; ++i) {
      state.x(i, j) = static_cast<T>(stream(i, j + 1) - stream(i, j));
    }
  }
  for (int j = 0; j <= height; ++j) {
    for (int i = 0; i < width; ++i) {
      state.y(i, j) = static_cast<T>(stream(i, j) - stream(i + 1, j));
    }
  }
  return state;
}

template <typename T>
Simulation<T>::Simulation(const Scene& scene)
    : shape_(scene.shape),
      wanted_(scene.wanted),
      frame_(scene.shape, retrograde::type_of<T>()),
      adjoint_(scene.shape, retrograde::type_of<T>(), scene.wanted),
      match_(scene.shape, retrograde::type_of<T>(), scene.reach),
      target_(scene.shape.width, scene.shape.height),
      forward_({frame_.next_x, frame_.next_y, frame_.next_density}),
      backward_(adjoint_.gradients),
      distance_({match_.loss, match_.difference}),
      slope_({match_.loss, match_.difference, match_.gradient}) {
  std::transform(scene.target.begin(), scene.target.end(), target_.data(),
                 [](float d) { return static_cast<T>(d); });
  match_.target.set(target_);
  for (Pipeline* pipeline : {&forward_, &backward_, &distance_, &slope_}) {
    pipeline->auto_schedule(retrograde::get_jit_target_from_environment());
  }
}

template <typename T>
void Simulation<T>::compile() {
  for (Pipeline* pipeline : {&forward_, &backward_, &distance_, &slope_}) pipeline->compile_jit();
}

template <typename T>
void Simulation<T>::bind(const Frame& frame, const Physics& physics, const State<T>& state,
                         T* force) {
  retrograde::ImageParam velocity_x = frame.velocity_x, velocity_y = frame.velocity_y,
                         density = frame.density, forces = frame.force;
  velocity_x.set(state.x);
  velocity_y.set(state.y);
  density.set(state.density);
  if (shape_.has_force) {
    forces.set(Buffer<T>(force, shape_.force_width, shape_.force_height, 2));
  }
  retrograde::Param<> time_step = frame.time_step, viscosity = frame.viscosity,
                      diffusion = frame.diffusion;
  time_step.set(static_cast<T>(physics.time_step));
  viscosity.set(static_cast<T>(physics.viscosity));
  diffusion.set(static_cast<T>(physics.diffusion));
}

template <typename T>
void Simulation<T>::advance(const Physics& physics, const State<T>& from, T* force, State<T>& to) {
  bind(frame_, physics, from, force);
  forward_.realize(Realization(std::vector<Buffer<>>{to.x, to.y, to.density}));
}

template <typename T>
void Simulation<T>::reverse(const Physics& physics, const State<T>& before, T* force,
                            const State<T>& seed, State<T>& result, T* by_force,
                            std::array<double, 3>& by_physics) {
  bind(adjoint_.frame, physics, before, force);
  adjoint_.seed_x.set(seed.x);
  adjoint_.seed_y.set(seed.y);
  adjoint_.seed_density.set(seed.density);
  std::vector<Buffer<>> outputs{result.x, result.y, result.density};
  if (wanted_.force) {
    outputs.emplace_back(Buffer<T>(by_force, shape_.force_width, shape_.force_height, 2));
  }
  const std::array<bool, 3> moves{wanted_.time_step, wanted_.viscosity, wanted_.diffusion};
  std::array<Buffer<T>, 3> scalars;
  for (size_t p = 0; p < 3; ++p) {
    if (!moves[p]) continue;
    scalars[p] = Buffer<T>::make_scalar();
    outputs.emplace_back(scalars[p]);
  }
  backward_.realize(Realization(outputs));
  for (size_t p = 0; p < 3; ++p) {
    if (moves[p]) by_physics[p] += scalars[p]();
  }
}

template <typename T>
typename Simulation<T>::Distance Simulation<T>::compare(const State<T>& state) {
  Buffer<T> loss = Buffer<T>::make_scalar(), difference = Buffer<T>::make_scalar();
  match_.density.set(state.density);
  distance_.realize(Realization(std::vector<Buffer<>>{loss, difference}));
  return {loss(), difference()};
}

template <typename T>
typename Simulation<T>::Distance Simulation<T>::compare(const State<T>& state,
                                                        Buffer<T>& gradient) {
  Buffer<T> loss = Buffer<T>::make_scalar(), difference = Buffer<T>::make_scalar();
  match_.density.set(state.density);
  slope_.realize(Realization(std::vector<Buffer<>>{loss, difference, gradient}));
  return {loss(), difference()};
}

template struct State<float>;
template struct State<double>;
template State<float> start_state(const Scene&);
template State<double> start_state(const Scene&);
template class Simulation<float>;
template class Simulation<double>;

}  // namespace fluid
