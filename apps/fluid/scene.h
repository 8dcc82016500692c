// scene.h -- what is simulated and what may be changed: the box, the smoke at the start and the
// picture that it shall be at the end, and the variables of the optimization as one flat vector.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "frame.h"

namespace fluid {

struct Physics {
  double time_step = 0.025;  // seconds a frame
  double viscosity = 1e-4;   // sides of the box squared a second
  double diffusion = 1e-6;   // the same, of the density
};

struct Scene {
  FrameShape shape;
  int frames = 40;
  Physics physics;                   // at the start of the optimization
  FrameAdjoint::Wanted wanted;       // what is optimized
  std::vector<float> start, target;  // densities: [height, width]
  std::vector<float> force;          // that is not optimized: [frames, force_elems], or nothing
  double swirl = 0;                  // speed of a vortex at the start, sides a second
  double reach = 0.2;                // see Match
  double effort = 1e-5;              // weight of the mean squared force
};

// What is held of the variables: the force of each frame, then the logarithms of time step,
// viscosity and diffusion against their starts, those that are optimized. So whatever an optimizer
// tries, they stay positive, and a step means the same at every size. Without that safeguard, which
// only --check-stability does without, they are factors: nothing keeps these from going below 0.
class Variables {
 public:
  explicit Variables(const Scene& scene, bool logarithms = true);

  size_t size() const { return force_size_ + scalars_; }
  size_t force_size() const { return force_size_; }
  std::vector<double> start() const { return std::vector<double>(size(), 0.0); }

  Physics physics(std::span<const double> x) const;
  // From the derivatives by time step, viscosity and diffusion to those by the variables.
  void add_gradient(std::span<const double> x, const std::array<double, 3>& by_physics,
                    std::span<double> gradient) const;

 private:
  Physics start_;
  std::array<bool, 3> moves_;
  bool logarithms_;
  size_t force_size_ = 0, scalars_ = 0;
};

}  // namespace fluid
