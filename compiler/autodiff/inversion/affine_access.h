// affine_access.h -- the indices and conditions of an access that isl represents, and the groups that they form.
#pragma once

#include <string>
#include <vector>

#include "autodiff/inversion/access_inversion.h"
#include "autodiff/inversion/group_inversion.h"

namespace retrograde::autodiff {

struct AffineAccess {
  std::vector<bool> takes_part;  // for each index: whether it is inverted
  std::vector<Expr> fixed;  // subexpressions that isl cannot represent and that became parameters
  std::vector<Expr> conjuncts;  // of the predicate, as far as isl represents them
  std::vector<Expr> residual;   // the other conjuncts, which stay expressions
  std::string note;             // why indices take no part
};

// The access before its indices are examined: all conjuncts, no index.
AffineAccess conjuncts_of(const AccessQuery& query);

// Decides which indices and conjuncts isl represents; conjuncts that were residual before stay so. `may_fix` allows
// parameters.
void resolve_indices(const AccessQuery& query, bool may_fix, AffineAccess& access);

// Variables, indices and conjuncts that are linked by variables.
std::vector<Group> linked_groups(const AccessQuery& query, const AffineAccess& access);

}  // namespace retrograde::autodiff
