// group_inversion.h -- inverts one group of linked indices; access_inversion.h explains the inversion as a whole.
#pragma once

#include <string>
#include <vector>

#include "autodiff/inversion/access_inversion.h"

namespace retrograde::autodiff {

// One piece of the inverted relation, for the dimensions of a group.
struct GroupPiece {
  struct FreeVariable {
    int var;  // position in the group's domain
    Expr extent;
  };
  std::vector<Expr> lhs;  // for each dimension of the group: element_name(d), or a fixed index
  std::vector<bool> pure;
  std::vector<FreeVariable> free;
  Substitution
      iteration;  // in terms of element_name, rho_name and, inside parameters, other stage variables
  std::vector<Expr> predicate;
};

// Names inside the inversion; the target's own names may coincide with the stage's.
std::string element_name(int d);
std::string rho_name(const std::string& stage_var);

// Stage variables and target dimensions that are linked through indices or predicates. Each group is inverted
// separately, so borders of x and of y are not multiplied into one union, and isl works on small spaces.
struct Group {
  std::vector<int> dims;      // dimensions of the target
  std::vector<Expr> indices;  // for each of dims
  std::vector<LoopVariable> vars;
  std::vector<Expr> predicate;       // conjuncts
  std::vector<LoopVariable> region;  // for each of dims, or empty
};

// Inverts the group; every point of its domain is in exactly one piece. `fixed` has the subexpressions that are
// parameters; `operations` as in AccessQuery.
std::vector<GroupPiece> invert_group(const Group& group, const std::vector<Expr>& fixed,
                                     unsigned long operations);

}  // namespace retrograde::autodiff
