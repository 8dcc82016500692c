// Inversion of one group of linked indices; see access_inversion.h for the whole.
#pragma once

#include <string>
#include <vector>

#include "autodiff/inversion/access_inversion.h"

namespace retrograde::autodiff {

// One way in which the elements of a group's dimensions are read.
struct GroupPiece {
  struct FreeVariable {
    int var;  // position in the group's domain
    Expr extent;
  };
  std::vector<Expr> lhs;  // one a dimension of the group: element_name(d), or a fixed index
  std::vector<bool> pure;
  std::vector<FreeVariable> free;
  Substitution
      iteration;  // over element_name, rho_name and, inside parameters, other stage variables
  std::vector<Expr> predicate;
};

// Names inside the inversion; the target's own names may coincide with the stage's.
std::string element_name(int d);
std::string rho_name(const std::string& stage_var);

// Stage variables and target dimensions that are linked through indices or predicates. Groups are
// inverted apart: borders of x and of y never multiply into one union, and isl works on small
// spaces.
struct Group {
  std::vector<int> dims;      // of the target
  std::vector<Expr> indices;  // one a dim
  std::vector<LoopVariable> vars;
  std::vector<Expr> predicate;       // conjuncts
  std::vector<LoopVariable> region;  // one a dim, or empty
};

// Every point of the group's domain is in exactly one piece. `fixed`: sub-expressions that are
// parameters. `operations`: see AccessQuery.
std::vector<GroupPiece> invert_group(const Group& group, const std::vector<Expr>& fixed,
                                     unsigned long operations);

}  // namespace retrograde::autodiff
