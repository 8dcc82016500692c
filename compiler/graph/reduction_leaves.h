// reduction_leaves.h -- the reduction variables of an update after the splits of its schedule: one
// variable for each reduction loop, and what the original ones are in terms of them.
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
  std::string name;  // in expressions; fresh
  Expr min, extent;
  Expr value() const { return variable(name); }
};

// The reduction variables of an update after its splits.
struct Leaves {
  std::vector<Leaf> all;
  Substitution values;        // original variable -> over leaves
  std::vector<Expr> tails;    // that splits do not run over the end
  std::vector<Split> others;  // splits of pure variables, left as they are
};

// CompileError, for what `asked` wants, when a reduction variable is fused with a pure one.
Leaves leaves_of(const Definition& update, const StageLoops& schedule, const std::string& asked);

}  // namespace retrograde::graph
