// reduction_leaves.h -- applies the splits of an update's schedule to its reduction variables: one
// variable for each resulting reduction loop, and the original variables in terms of these leaves.
//
//   r over [0, n) split into (ro, ri) by 8    =>    ro over [0, ceil(n / 8)), ri over [0, 8),
//                                                   r == ro * 8 + ri, where ro * 8 + ri < n
#pragma once

#include <string>
#include <vector>

#include "graph/function.h"
#include "ir/build.h"
#include "ir/visit.h"

namespace retrograde::graph {

// A reduction loop as a variable.
struct Leaf {
  std::string loop;  // its name in the schedule
  std::string name;  // in expressions; unique
  Expr min, extent;
  Expr value() const { return variable(name); }
};

// The reduction variables of an update after its splits.
struct Leaves {
  std::vector<Leaf> all;
  Substitution values;        // original variables in terms of leaves
  std::vector<Expr> tails;    // conditions that keep splits from running past the end
  std::vector<Split> others;  // splits of pure variables, unchanged
};

// CompileError, which quotes `asked`, when a reduction variable is fused with a pure one.
Leaves leaves_of(const Definition& update, const StageLoops& schedule, const std::string& asked);

}  // namespace retrograde::graph
