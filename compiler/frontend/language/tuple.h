// tuple.h -- Tuple, the values of a Func with more than one output at one point.
#pragma once

#include <vector>

#include "ir/build.h"

namespace retrograde {

class FuncRef;

// Several values of one point.
class Tuple {
 public:
  explicit Tuple(Expr e) : exprs_{std::move(e)} {}  // a Tuple of one value
  // A Tuple of the given values.
  // Requires: a Tuple has at least one element.
  explicit Tuple(const std::vector<Expr>& exprs);
  template <typename... Args>
  Tuple(const Expr& a, const Expr& b, Args&&... rest)
      : exprs_{a, b, Expr(std::forward<Args>(rest))...} {}
  Tuple(const FuncRef& ref);  // all values of a Func at a point

  size_t size() const { return exprs_.size(); }  // number of elements
  // Element i.
  // Requires: elements are numbered from 0.
  Expr& operator[](size_t i);
  Expr operator[](size_t i) const;
  // All elements.
  const std::vector<Expr>& as_vector() const { return exprs_; }

 private:
  void check_index(size_t i) const;
  std::vector<Expr> exprs_;
};

}  // namespace retrograde
