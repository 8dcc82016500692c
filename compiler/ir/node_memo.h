// A memo table of facts about expressions, keyed by node.
#pragma once

#include <unordered_map>
#include <utility>

#include "ir/expr.h"

namespace retrograde::ir {

template <class T>
class NodeMemo {
 public:
  // The memoised value of the node; computes it with `find_out` at the first request. `find_out`
  // may request other nodes.
  template <class FindOut>
  T get(const Expr& e, const FindOut& find_out) {
    if (const auto* found = find_or_null(known_, e.get())) return found->second;
    T result = find_out();
    known_.emplace(e.get(), std::pair(e, result));
    return result;
  }
  void clear() { known_.clear(); }

 private:
  // Holds the keys alive, so that no other node gets their addresses.
  std::unordered_map<const ExprNode*, std::pair<Expr, T>> known_;
};

}  // namespace retrograde::ir
