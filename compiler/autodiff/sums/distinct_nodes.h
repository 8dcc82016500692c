// distinct_nodes.h -- numbers the distinct nodes of expressions; structurally equal nodes count as one.
#pragma once

#include <cstddef>
#include <unordered_map>
#include <vector>

#include "ir/expr.h"

namespace retrograde::autodiff {

class DistinctNodes {
 public:
  // Undefined roots are skipped.
  explicit DistinctNodes(const std::vector<Expr>& roots);
  // Indexed by number; children before parents.
  const std::vector<Expr>& nodes() const { return nodes_; }
  // The number of a root or a node below one.
  size_t number_of(const Expr& e) const { return by_node_.at(e.get()); }

 private:
  std::vector<Expr> nodes_;
  std::vector<Expr> kept_;  // keeps the nodes of by_node_ alive
  std::unordered_map<const ExprNode*, size_t> by_node_;
};

// Returns the expressions with equal nodes shared. Undefined ones stay undefined. Leaves, with their indices, are not
// rebuilt: others look them up by node, and rebuilding an index might simplify it.
std::vector<Expr> with_equal_nodes_shared(const std::vector<Expr>& roots);

}  // namespace retrograde::autodiff
