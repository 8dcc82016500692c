// gradient_check.cpp -- see gradient_check.h.
//
// The loss is smooth except for kinks, where advection reads at the border between two cells or at a wall. A difference
// across a kink is wrong, and a tiny step suffers from rounding, especially for variables with little influence, such
// as a small diffusion. So central differences of fourth order are computed with several steps, and the best agreement
// counts. A wrong adjoint would agree with none.
#include "gradient_check.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <string>

#include "control.h"
#include "smoke.h"

namespace fluid {

namespace {

constexpr int most_cells = 20, most_frames = 5, most_nodes = 5;
constexpr int random_directions = 3;
constexpr double force_size = 2.0;  // sides per second squared
constexpr double steps[] = {1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6};

struct Group {
  std::string name;
  size_t begin, end;
};

std::vector<Group> groups_of(const Scene& scene, const Variables& variables) {
  std::vector<Group> groups;
  size_t at = variables.force_size();
  if (at > 0) groups.push_back({"force", 0, at});
  const auto one = [&](bool wanted, const char* name) {
    if (!wanted) return;
    groups.push_back({name, at, at + 1});
    ++at;
  };
  one(scene.wanted.time_step, "time_step");
  one(scene.wanted.viscosity, "viscosity");
  one(scene.wanted.diffusion, "diffusion");
  return groups;
}

double length(std::span<const double> v) {
  double sum = 0;
  for (const double value : v) sum += value * value;
  return std::sqrt(sum);
}

class DirectionCheck {
 public:
  DirectionCheck(Control<double>& control, const std::vector<double>& x, const Group& group,
                 std::span<const double> gradient)
      : control_(control), x_(x), group_(group), gradient_(gradient) {}

  // The error of the difference along `direction`, relative to the typical derivative along a direction of this length.
  double error(std::span<const double> direction) const {
    double adjoint = 0;
    for (size_t n = 0; n < direction.size(); ++n) adjoint += direction[n] * gradient_[n];
    const double usual =
        length(gradient_) * length(direction) / std::sqrt(static_cast<double>(direction.size()));
    double best = INFINITY;
    for (const double step : steps) {
      const double difference = central_difference(direction, step);
      const double scale = std::max({std::abs(difference), std::abs(adjoint), usual});
      const double error = scale > 0 ? std::abs(difference - adjoint) / scale : 0;
      if (error < best) best = error;
    }
    return best;
  }

 private:
  double central_difference(std::span<const double> direction, double step) const {
    const double unit = step / std::max(length(direction), 1e-300) *
                        std::sqrt(static_cast<double>(direction.size()));
    const auto loss_at = [&](double move) {
      std::vector<double> moved = x_;
      for (size_t n = 0; n < direction.size(); ++n) moved[group_.begin + n] += move * direction[n];
      return control_.loss(moved);
    };
    const double near = loss_at(unit) - loss_at(-unit),
                 far = loss_at(2 * unit) - loss_at(-2 * unit);
    return (8 * near - far) / (12 * unit);
  }

  Control<double>& control_;
  const std::vector<double>& x_;
  const Group& group_;
  std::span<const double> gradient_;
};

}  // namespace

Scene small_scene(const Scene& scene) {
  Scene small = scene;
  FrameShape& s = small.shape;
  const double scale = std::min(1.0, static_cast<double>(most_cells) / s.cells_per_unit());
  const bool in_each_cell = s.has_force_in_each_cell();
  const auto shrink = [&](std::vector<float>& density) {
    const Smoke smoke{s.width, s.height, density};
    density = resample(smoke, std::max(4, static_cast<int>(s.width * scale)),
                       std::max(4, static_cast<int>(s.height * scale)))
                  .density;
  };
  shrink(small.start);
  shrink(small.target);
  s.width = std::max(4, static_cast<int>(s.width * scale));
  s.height = std::max(4, static_cast<int>(s.height * scale));
  s.force_width = in_each_cell ? s.width : std::min(s.force_width, most_nodes);
  s.force_height = in_each_cell ? s.height : std::min(s.force_height, most_nodes);
  small.frames = std::min(scene.frames, most_frames);
  small.force.clear();
  if (!small.wanted.force) s.has_force = false;
  if (small.swirl == 0) small.swirl = 0.5;
  return small;
}

std::vector<double> random_point(const Variables& variables, uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::vector<double> x(variables.size());
  for (size_t n = 0; n < x.size(); ++n) {
    x[n] = (n < variables.force_size() ? force_size : 1.0) * normal(random);
  }
  return x;
}

std::vector<apps::GradientRow> check_gradients(const Scene& scene, uint64_t seed) {
  const Scene small = small_scene(scene);
  Control<double> exact(small, small.frames);
  Control<float> own(small, small.frames);
  const std::vector<double> x = random_point(exact.variables(), seed);
  std::vector<double> gradient(x.size()), in_float(x.size());
  exact.loss(x, gradient);
  own.loss(x, in_float);
  std::mt19937_64 random(seed + 1);
  std::normal_distribution<double> normal;
  std::vector<apps::GradientRow> rows;
  for (const Group& group : groups_of(small, exact.variables())) {
    const size_t size = group.end - group.begin;
    const std::span<const double> adjoint(gradient.data() + group.begin, size);
    const DirectionCheck check(exact, x, group, adjoint);
    apps::GradientRow row{group.name, check.error(adjoint), 0, "differences"};
    for (int d = 0; d < random_directions && size > 1; ++d) {
      std::vector<double> direction(size);
      for (double& value : direction) value = normal(random);
      row.in_double = std::max(row.in_double, check.error(direction));
    }
    row.in_float = apps::relative_error({in_float.data() + group.begin, size}, adjoint);
    rows.push_back(row);
  }
  return rows;
}

}  // namespace fluid
