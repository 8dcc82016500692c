// The distinct nodes below some expressions, equal ones taken together.
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
  // By number, children before parents.
  const std::vector<Expr>& nodes() const { return nodes_; }
  // Of a root or a node below one.
  size_t number_of(const Expr& e) const { return by_node_.at(e.get()); }

 private:
  std::vector<Expr> nodes_;
  std::vector<Expr> kept_;  // whose addresses stand in by_node_
  std::unordered_map<const ExprNode*, size_t> by_node_;
};

// The same expressions, in which equal nodes are one. Undefined ones stay so. Leaves are left as
// they are, inside too: others look for them, and an index that is built again may be simplified.
std::vector<Expr> with_equal_nodes_shared(const std::vector<Expr>& roots);

}  // namespace retrograde::autodiff
