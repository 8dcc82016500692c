// simulation.h -- runs frames and their vector-Jacobian products, compiled, on states in memory.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "match.h"
#include "scene.h"

namespace fluid {

// The state between two frames; its adjoint has the same shape.
template <typename T>
struct State {
  explicit State(const FrameShape& shape);
  void copy_from(const State& other);
  void fill(T value);

  retrograde::Buffer<T> x, y, density;
};

// The smoke and the vortex at the beginning of a scene.
template <typename T>
State<T> start_state(const Scene& scene);

template <typename T>
class Simulation {
 public:
  explicit Simulation(const Scene& scene);

  // Advances one state to the next. `force`: the elements for this frame.
  void advance(const Physics& physics, const State<T>& from, T* force, State<T>& to);

  // Runs a frame backward. `seed` is the adjoint of the state after the frame. `result` receives the adjoint of the
  // state before it, and `by_force`, if the force is wanted, that of the force. The derivatives by time step, viscosity
  // and diffusion are added to `by_physics`.
  void reverse(const Physics& physics, const State<T>& before, T* force, const State<T>& seed,
               State<T>& result, T* by_force, std::array<double, 3>& by_physics);

  // The distance from the target, and its derivative by the density.
  struct Distance {
    double loss, difference;
  };
  Distance compare(const State<T>& state);
  Distance compare(const State<T>& state, retrograde::Buffer<T>& gradient);

  // Compiles the pipelines that are not compiled yet; otherwise the first call of each one does.
  void compile();
  const FrameAdjoint& adjoint() const { return adjoint_; }

 private:
  void bind(const Frame& frame, const Physics& physics, const State<T>& state, T* force);

  FrameShape shape_;
  FrameAdjoint::Wanted wanted_;
  Frame frame_;
  FrameAdjoint adjoint_;
  Match match_;
  retrograde::Buffer<T> target_, no_force_;
  retrograde::Pipeline forward_, backward_, distance_, slope_;
};

}  // namespace fluid
