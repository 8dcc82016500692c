// What was found out about expressions, by node.
#pragma once

#include <unordered_map>
#include <utility>

#include "ir/expr.h"

namespace retrograde::ir {

template <class T>
class NodeMemo {
 public:
  // What is known of the node, or else what `find_out` gives, which may ask for others.
  template <class FindOut>
  T get(const Expr& e, const FindOut& find_out) {
    if (const auto* found = find_or_null(known_, e.get())) return found->second;
    T result = find_out();
    known_.emplace(e.get(), std::pair(e, result));
    return result;
  }
  void clear() { known_.clear(); }

 private:
  // Keys are kept alive so that their addresses stay their own.
  std::unordered_map<const ExprNode*, std::pair<Expr, T>> known_;
};

}  // namespace retrograde::ir
