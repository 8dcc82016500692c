// privatisation.h -- plans privatised accumulators: when a sum is split, into how many parts, and the loops of one
// part.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "autodiff/sums/taps.h"
#include "autoschedule/machine/reference.h"

namespace retrograde::autodiff {

// The number of vector lanes of a part; neighbouring iterations accumulate in separate lanes.
inline constexpr int lane_count = planning::schedule_lanes;
// The assumed value of an extent that is known at run time only.
inline constexpr double unknown_elements = 1e9;

// Whether an element may sum many terms. A scatter may send all its iterations to one element. `types` are the types of
// accumulation.
bool sums_many_terms(const Gather& g, const AdjointTarget& target, const std::vector<Type>& types);

struct PartPlan {
  bool has_parts = false;
  size_t loop = 0;  // that is split into parts, among the reduction variables
  Expr count;       // number of parts that fit, evaluated at run time
  bool has_lanes = false;
  std::string note;  // memory that the parts take; may be empty
};
// Returns nullopt if the update is not worth splitting.
std::optional<PartPlan> plan_parts(const Iterations& update, const AdjointTarget& target,
                                   const std::vector<Type>& types);

// The same sum with a reduction variable first that moves along the rows of what is read, if the first one moves from row
// to row: lanes split the first, and would gather. In the domain of a recurrence along rows, pure dimensions come first.
// The plan goes on to split the same variable into parts.
Iterations with_rows_innermost(Iterations update, PartPlan& plan);

// One slice of the reduction domain, for a fixed lane and part.
struct Slice {
  std::vector<ReductionVariable> rvars;
  Substitution place;            // reduction variable of the gather -> its value
  std::vector<Expr> conditions;  // true inside the domain
};
// An undefined `lane` means no lanes, an undefined `part` no parts. With `in_blocks`, split loops run over whole blocks
// of blocked_sums.h.
Slice slice_of(const Iterations& update, const Expr& lane, const Expr& part, const PartPlan& plan,
               bool in_blocks);

// Coordinates of the Func that holds the parts: the lane, then the elements (those that a scatter reaches, or the pure
// ones), then the part. Lane and part are left out if undefined.
std::vector<Expr> parts_point(const Gather& g, const std::vector<Expr>& element, const Expr& lane,
                              const Expr& part);

}  // namespace retrograde::autodiff
