// scene.h -- the simulated scene: the box, the initial smoke, the target picture, and the variables of the optimization
// as one flat vector.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "frame.h"

namespace fluid {

struct Physics {
  double time_step = 0.025;  // seconds per frame
  double viscosity = 1e-4;   // sides of the box squared per second
  double diffusion = 1e-6;   // the same, for the density
};

struct Scene {
  FrameShape shape;
  int frames = 40;
  Physics physics;                   // initial values of the optimization
  FrameAdjoint::Wanted wanted;       // what is optimized
  std::vector<float> start, target;  // densities: [height, width]
  std::vector<float> force;  // a force that is not optimized: [frames, force_elems], or empty
  double swirl = 0;          // speed of an initial vortex, sides per second
  double reach = 0.2;        // see Match
  double effort = 1e-5;      // weight of the mean squared force
};

// Layout of the variables: the force of each frame, then the logarithms of time step, viscosity and diffusion relative
// to their initial values, as far as they are optimized. So these always stay positive, and a step has the same
// relative effect at every size. Without logarithms, which only --check-stability uses, they are factors and may become
// negative.
class Variables {
 public:
  explicit Variables(const Scene& scene, bool logarithms = true);

  size_t size() const { return force_size_ + scalars_; }
  size_t force_size() const { return force_size_; }
  std::vector<double> start() const { return std::vector<double>(size(), 0.0); }

  Physics physics(std::span<const double> x) const;
  // Converts derivatives by time step, viscosity and diffusion to derivatives by the variables.
  void add_gradient(std::span<const double> x, const std::array<double, 3>& by_physics,
                    std::span<double> gradient) const;

 private:
  Physics start_;
  std::array<bool, 3> moves_;
  bool logarithms_;
  size_t force_size_ = 0, scalars_ = 0;
};

}  // namespace fluid
