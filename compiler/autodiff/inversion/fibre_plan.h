// fibre_plan.h -- decides, for each stage variable, whether the element read determines it or a new loop runs over it.
//
// The fibre over an element is the set of points of a stage that read it. Variables that the element determines become
// functions of it; the others run over as few values as possible.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "autodiff/inversion/group_inversion.h"
#include "autodiff/inversion/isl_bridge.h"

namespace retrograde::autodiff {

constexpr int64_t unbounded = -1;

// One stage variable in the fibre over an element.
struct FibreCoordinate {
  bool is_free = false;
  isl::pw_aff value;       // in terms of y and of the rhos chosen before it
  int rho = -1;            // free: number of the new variable
  bool is_static = false;  // free: runs over its own domain, whatever y is
  int64_t extent = 1;      // free: number of steps, `unbounded` when parametric
};

struct FibrePlan {
  std::vector<FibreCoordinate> coordinates;  // for each stage variable
  isl::set valid;                            // valid points, over (y, rho...)
  std::vector<int> free_vars;                // stage variable of each rho
  double cost = 1;  // iterations for each element; infinite when parametric
};

// The input of the plan: the stage's variables, the set that they run over without the predicate, and the range of each
// variable alone.
struct FibreSpace {
  const std::vector<LoopVariable>& vars;
  IslBridge& bridge;
  const isl::set& box;
  const std::vector<isl::set>& own_range;
};

// Plans the fibres of one piece of the relation {points of the stage -> elements}.
FibrePlan plan_fibre(const FibreSpace& space, const isl::map& piece);

unsigned pieces_of(const isl::pw_aff& e);
std::optional<isl::pw_aff> function_of(const isl::map& one_output);  // nullopt: not a function

}  // namespace retrograde::autodiff
