// never_meet -- whether two points of a loop nest can come to the same place of a Func.
//
//   f(4*r.x + r.y), r.y in [0, 4)      r.x != r.x'   =>   4*r.x + r.y != 4*r.x' + r.y'
//   f(n - 1 - r) reading f(r), r < n/2                    n - 1 - r != r'
//
// The two points have variables of their own; what neither varies is the same for both. Places are
// taken apart into sums, divisions and remainders by constants, minima and maxima; anything else is
// a number of its own, of which only the type is known. Whether the conditions have a solution is
// decided over the integers (isl, Presburger sets).
#pragma once

#include <string>
#include <vector>

#include "ir/expr.h"

namespace retrograde::analysis {

// Points of a loop nest: variables with their ranges, and conditions that hold at each of them.
struct MeetingPoints {
  struct Variable {
    std::string name;
    Expr min, max;  // undefined: no end
  };
  std::vector<Variable> variables;
  std::vector<Expr> conditions;
};

// True when for no two points whose `loop` differs, place `a` of one is place `b` of the other, in
// all dimensions. False means unknown.
bool can_prove_never_meet(const MeetingPoints& points, const std::string& loop,
                          const std::vector<Expr>& a, const std::vector<Expr>& b);

}  // namespace retrograde::analysis
