// never_meet -- proves that two points of a loop nest never access the same element of a Func.
//
//   f(4*r.x + r.y), r.y in [0, 4)      r.x != r.x'   =>   4*r.x + r.y != 4*r.x' + r.y'
//   f(n - 1 - r) reading f(r), r < n/2                    n - 1 - r != r'
//
// The two points have separate variables; whatever does not depend on them is the same for both.
// Coordinates are decomposed into sums, divisions and remainders by constants, minima and maxima.
// Every other expression is an unknown of which only the type matters. isl decides whether the
// resulting conditions (a Presburger set) have an integer solution.
#pragma once

#include <string>
#include <unordered_set>
#include <vector>

#include "ir/expr.h"

namespace retrograde::analysis {

// How large the conditions of a proof may be. isl takes up to a second for the largest, and a search asks for many proofs.
enum class ProofEffort { Full, Quick };

// The points of a loop nest: variables with their ranges, and conditions that hold at every point.
struct MeetingPoints {
  struct Variable {
    std::string name;
    Expr min, max;  // undefined: unbounded
  };
  std::vector<Variable> variables;
  std::vector<Expr> conditions;
  ProofEffort effort = ProofEffort::Full;
};

// How the second of two points lies to the first one, in the order of the loops.
struct PointOrder {
  std::unordered_set<std::string> same;  // variables that have the same value at both
  // Variables whose value at the second point is larger, and smaller.
  std::vector<std::string> larger, smaller;
};

// The coordinates that a point accesses, if a condition (undefined: true) holds there.
struct Access {
  std::vector<Expr> at;
  Expr where;
};

// True when no two points that lie so to each other have coordinates `a` of the first equal to
// coordinates `b` of the second, in all dimensions. False means unknown.
bool can_prove_never_meet(const MeetingPoints& points, const PointOrder& order, const Access& a,
                          const Access& b);

// The same for all pairs of points that differ in `loop` and agree in the variables `same`.
bool can_prove_never_meet(const MeetingPoints& points, const std::string& loop, const Access& a,
                          const Access& b, const std::unordered_set<std::string>& same = {});

}  // namespace retrograde::analysis
