// inlined_size.h -- estimates the size of Funcs after inlining: each distinct call node makes a
// copy of the callee's body; calls of one element share a copy.
#pragma once

#include <unordered_map>

#include "graph/function.h"

namespace retrograde::graph {

class InlinedSizes {
 public:
  // From now on, each call of `f` counts as a copy of a body of `nodes` nodes.
  void inline_calls_of(const FuncContents& f, double nodes) { nodes_[&f] = nodes; }
  // The number of nodes in the definitions of `f`, with its inlined callees.
  double nodes(const FuncContents& f) const;
  // The inlined callee that contributes the most nodes to `f`; null when none is inlined.
  FuncPtr largest_part(const FuncContents& f) const;

 private:
  std::unordered_map<const Symbol*, double> nodes_;
};

// The number of distinct nodes that call other Funcs, by callee. In a stage, calls of one element count once.
std::unordered_map<const Symbol*, int> func_calls(const FuncContents& f);

}  // namespace retrograde::graph
