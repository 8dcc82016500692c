// memory_plan.cpp -- see memory_plan.h.
#include "memory_plan.h"

#include <algorithm>

#include "diagnostics/error.h"

namespace fluid {

using retrograde::text;

namespace {

constexpr double megabyte = 1e6;

// Floats per cell that a backward frame needs, including states and seeds: its adjoints, and the privatised copies for
// sums with data-dependent indices (explain() names them). Measured: 90 to 110.
constexpr double floats_a_cell = 110;
// Matrices of waves: four per solve; solves are for two velocities, pressure and density, forward and backward.
constexpr double wave_tables = 24;
// Vectors of doubles that each method needs, including those of the state file: Adam has its moments and three points;
// Ceres keeps 20 pairs for L-BFGS.
double vectors_of(apps::Method method) {
  switch (method) {
    case apps::Method::Adam:
      return 14;
    case apps::Method::Lbfgs:
      return 52;
    default:
      return 18;
  }
}

[[noreturn]] void refuse(const Scene& scene, double limit_mb, double needed_mb,
                         const std::string& what) {
  retrograde::call_error(text("simulate ", scene.frames, " frames of ", scene.shape.width, " x ",
                              scene.shape.height, " cells within --memory ", limit_mb),
                         what, text("about ", static_cast<long>(needed_mb) + 1, " MB are needed"),
                         "Give more --memory, fewer --cells, or fewer --force-nodes");
}

double solver_mb(const FrameShape& s) {
  const double matrices =
      static_cast<double>(s.width) * s.width + static_cast<double>(s.height) * s.height;
  return matrices * wave_tables * sizeof(float) / megabyte;
}

}  // namespace

void require_memory_for_a_frame(const Scene& scene, double limit_mb) {
  const double needed =
      static_cast<double>(scene.shape.cells()) * floats_a_cell * sizeof(float) / megabyte +
      solver_mb(scene.shape);
  if (needed > limit_mb) {
    refuse(scene, limit_mb, needed, "one frame must fit, forward and backward");
  }
}

MemoryPlan plan_memory(const Scene& scene, const std::vector<apps::Method>& methods,
                       double limit_mb, double used_mb) {
  MemoryPlan plan;
  plan.state_mb = static_cast<double>(scene.shape.state_elems()) * sizeof(float) / megabyte;
  double vectors = 0;
  for (const apps::Method method : methods) vectors = std::max(vectors, vectors_of(method));
  plan.variables_mb =
      static_cast<double>(Variables(scene).size()) * vectors * sizeof(double) / megabyte;
  const double left = limit_mb - used_mb - plan.variables_mb;
  if (left < plan.state_mb) {
    refuse(scene, limit_mb, used_mb + plan.variables_mb + plan.state_mb,
           "the program, the optimizer's vectors and one state must fit");
  }
  plan.slots = static_cast<int>(std::min<double>(scene.frames, left / plan.state_mb));
  return plan;
}

}  // namespace fluid
