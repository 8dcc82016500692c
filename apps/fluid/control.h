// control.h -- the loss of a whole simulation and its gradient by all variables.
//
//   loss(x) = Match of the last frame's density + effort * mean squared force
//
// The gradient runs backward in time from checkpoints. It is the same to the last bit for any number of kept states
// (checkpoints.h).
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "simulation.h"

namespace fluid {

template <typename T>
class Control {
 public:
  explicit Control(const Scene& scene, int slots = 1);

  const Scene& scene() const { return scene_; }
  const Variables& variables() const { return variables_; }
  Simulation<T>& simulation() { return simulation_; }
  // Number of states that are kept; at most one per frame.
  int slots() const { return static_cast<int>(kept_.size()); }
  void keep_states(int slots);
  // Compiles everything and runs it once, so that all memory that it needs is allocated.
  void compile();
  // Sets other initial values of time step, viscosity and diffusion; `logarithms`: see Variables.
  void start_from(const Physics& physics, bool logarithms);

  double loss(std::span<const double> x);
  // If `gradient` is empty, only the loss is computed.
  double loss(std::span<const double> x, std::span<double> gradient);
  // The mean squared difference between the last computed density and the target.
  double difference() const { return difference_; }

  // Runs forward and calls `show` with each state after a frame; with state 0 first.
  void play(std::span<const double> x, const std::function<void(const State<T>&)>& show);

 private:
  void take(std::span<const double> x);
  double effort(std::span<double> gradient) const;
  T* force_of(int frame) { return force_.data() + frame * scene_.shape.force_elems(); }
  double turn_around(int frame);

  Scene scene_;
  Variables variables_;
  Simulation<T> simulation_;
  Physics physics_;
  std::vector<T> force_, by_force_;  // [frames, force_elems]; [force_elems]
  std::vector<State<T>> kept_;       // kept_[0]: the initial state
  State<T> now_, next_, seed_, before_;
  double difference_ = 0;
};

}  // namespace fluid
