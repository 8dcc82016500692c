// Common subexpressions: converts a DAG with shared nodes to nested Lets and back.
#pragma once

#include "ir/build.h"

namespace retrograde::simplification {

// Subexpressions that occur more than once become Lets with fresh names around the expression.
// Equality is structural; leaves and trivial operations stay. Subexpressions used only in one arm
// of if_then_else are bound in that arm. Existing Lets are expanded first.
Expr introduce_lets(const Expr& e);

// The same for several expressions that are evaluated together. `lets` are outermost first; each is
// visible in the later ones and in the values.
struct SharedLets {
  Lets lets;
  std::vector<Expr> values;
};
SharedLets introduce_lets(const std::vector<Expr>& es);

// Replaces every Let by sharing; the result has none. Linear in the number of nodes.
Expr expand_lets(const Expr& e);

}  // namespace retrograde::simplification
