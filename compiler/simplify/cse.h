// Sharing made explicit and back: a DAG of shared nodes <-> nested Lets.
#pragma once

#include "ir/build.h"

namespace retrograde::simplification {

// Sub-expressions that occur more than once (structurally; leaves and trivial operations excepted)
// become Lets around the expression, with fresh names. What only an arm of if_then_else computes
// stays in the arm. Lets already there are expanded first.
Expr introduce_lets(const Expr& e);

// The same for several expressions that are evaluated together: `lets` outermost first, each
// visible in the later ones and in the values.
struct SharedLets {
  Lets lets;
  std::vector<Expr> values;
};
SharedLets introduce_lets(const std::vector<Expr>& es);

// Replaces Lets by sharing: the result has none. Linear in the number of nodes.
Expr expand_lets(const Expr& e);

}  // namespace retrograde::simplification
