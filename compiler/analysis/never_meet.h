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
#include <vector>

#include "ir/expr.h"

namespace retrograde::analysis {

// The points of a loop nest: variables with their ranges, and conditions that hold at every point.
struct MeetingPoints {
  struct Variable {
    std::string name;
    Expr min, max;  // undefined: unbounded
  };
  std::vector<Variable> variables;
  std::vector<Expr> conditions;
};

// True when no two points that differ in `loop` have coordinates `a` of one equal to coordinates
// `b` of the other, in all dimensions. False means unknown.
bool can_prove_never_meet(const MeetingPoints& points, const std::string& loop,
                          const std::vector<Expr>& a, const std::vector<Expr>& b);

}  // namespace retrograde::analysis
