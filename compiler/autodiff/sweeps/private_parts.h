// Private parts of an accumulation: when and into how many a sum is split, the iterations of one.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "autodiff/sweeps/taps.h"

namespace retrograde::autodiff {

// Elements of a part's vector: neighbouring iterations accumulate apart.
inline constexpr int lane_count = 16;
// What an extent counts that is known at run time only.
inline constexpr double unknown_elements = 1e9;

// Whether an element may get many terms. Data may send all iterations of a scatter to one. `types`:
// in which is accumulated.
bool sums_many_terms(const Gather& g, const AdjointTarget& target, const std::vector<Type>& types);

struct PartPlan {
  bool has_parts = false;
  Expr count;  // of parts: as many as fit at run time
  bool has_lanes = false;
  std::string note;  // what the parts take; may be empty
};
// nullopt: the update is not worth splitting.
std::optional<PartPlan> plan_parts(const Iterations& update, const AdjointTarget& target,
                                   const std::vector<Type>& types);

// One slice of the reduction domain, in which lane and part are fixed.
struct Slice {
  std::vector<ReductionVariable> rvars;
  Substitution place;            // reduction variable of the gather -> its value
  std::vector<Expr> conditions;  // inside the domain
};
// Without `lane` there are no lanes, without `part` no parts. `in_blocks`: loops that are cut run
// over whole blocks of blocked_sums.h.
Slice slice_of(const Iterations& update, const Expr& lane, const Expr& part, const Expr& parts,
               bool in_blocks);

// Coordinates of the Func of parts: the lane, the elements that a scatter reaches or the pure ones,
// the part; lane and part where they are defined.
std::vector<Expr> parts_point(const Gather& g, const std::vector<Expr>& element, const Expr& lane,
                              const Expr& part);

}  // namespace retrograde::autodiff
