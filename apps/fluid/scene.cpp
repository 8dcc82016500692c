// scene.cpp -- see scene.h.
#include "scene.h"

#include <cmath>

namespace fluid {

namespace {

// Scale of a step for the logarithms, relative to the elements of the force.
constexpr double scalar_scale = 0.1;

std::array<double, 3> as_array(const Physics& p) { return {p.time_step, p.viscosity, p.diffusion}; }

}  // namespace

Variables::Variables(const Scene& scene, bool logarithms)
    : start_(scene.physics),
      moves_{scene.wanted.time_step, scene.wanted.viscosity, scene.wanted.diffusion},
      logarithms_(logarithms) {
  if (scene.wanted.force) {
    force_size_ = static_cast<size_t>(scene.frames) * scene.shape.force_elems();
  }
  for (const bool moves : moves_) scalars_ += moves ? 1 : 0;
}

Physics Variables::physics(std::span<const double> x) const {
  std::array<double, 3> values = as_array(start_);
  size_t at = force_size_;
  for (size_t p = 0; p < 3; ++p) {
    if (!moves_[p]) continue;
    const double move = scalar_scale * x[at++];
    values[p] *= logarithms_ ? std::exp(move) : 1 + move;
  }
  return {values[0], values[1], values[2]};
}

void Variables::add_gradient(std::span<const double> x, const std::array<double, 3>& by_physics,
                             std::span<double> gradient) const {
  const std::array<double, 3> slopes = as_array(logarithms_ ? physics(x) : start_);
  size_t at = force_size_;
  for (size_t p = 0; p < 3; ++p) {
    if (moves_[p]) gradient[at++] += by_physics[p] * slopes[p] * scalar_scale;
  }
}

}  // namespace fluid
