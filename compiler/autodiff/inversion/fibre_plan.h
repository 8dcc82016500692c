// fibre_plan.h -- the points of a stage that read one element, variable by variable: what the
// element determines is a function of it, the rest runs over as few values as possible.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "autodiff/inversion/group_inversion.h"
#include "autodiff/inversion/isl_bridge.h"

namespace retrograde::autodiff {

constexpr int64_t unbounded = -1;

// What a stage variable is in the fibre over an element.
struct FibreCoordinate {
  bool is_free = false;
  isl::pw_aff value;       // over (y, rho...) as far as known then
  int rho = -1;            // free: which new variable
  bool is_static = false;  // free: runs over its own domain, whatever y
  int64_t extent = 1;      // free: number of steps, `unbounded` when parametric
};

struct FibrePlan {
  std::vector<FibreCoordinate> coordinates;  // one a stage variable
  isl::set valid;                            // over (y, rho...)
  std::vector<int> free_vars;                // stage variable of each rho
  double cost = 1;  // iterations for each element; infinite when parametric
};

// What the plan is for: the stage's variables, the set that they run over without the predicate, and
// what each of them runs over alone.
struct FibreSpace {
  const std::vector<LoopVariable>& vars;
  IslBridge& bridge;
  const isl::set& box;
  const std::vector<isl::set>& own_range;
};

// Of a part of the relation {points of the stage -> elements}.
FibrePlan plan_fibre(const FibreSpace& space, const isl::map& piece);

unsigned pieces_of(const isl::pw_aff& e);
std::optional<isl::pw_aff> function_of(const isl::map& one_output);  // that it is

}  // namespace retrograde::autodiff
