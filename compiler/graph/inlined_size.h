// inlined_size.h -- how large the expressions of Funcs become when others are inlined into them:
// each call that is a node of its own makes a copy of the callee's body.
#pragma once

#include <unordered_map>

#include "graph/function.h"

namespace retrograde::graph {

class InlinedSizes {
 public:
  // From now on its calls are copies of a body of so many nodes.
  void inline_calls_of(const FuncContents& f, double nodes) { nodes_[&f] = nodes; }
  // Nodes of the definitions of `f`, with what is inlined into them.
  double nodes(const FuncContents& f) const;
  // Which of the Funcs that are inlined into `f` makes most of them; null: none is.
  FuncPtr largest_part(const FuncContents& f) const;

 private:
  std::unordered_map<const Symbol*, double> nodes_;
};

// Different nodes that are calls of other Funcs, by callee.
std::unordered_map<const Symbol*, int> func_calls(const FuncContents& f);

}  // namespace retrograde::graph
