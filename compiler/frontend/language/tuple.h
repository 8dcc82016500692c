// tuple.h -- several values of one point: what a Func with more than one output holds.
#pragma once

#include <vector>

#include "ir/build.h"

namespace retrograde {

class FuncRef;

class Tuple {
 public:
  explicit Tuple(Expr e) : exprs_{std::move(e)} {}
  // Requires: a Tuple has at least one element.
  explicit Tuple(const std::vector<Expr>& exprs);
  template <typename... Args>
  Tuple(const Expr& a, const Expr& b, Args&&... rest)
      : exprs_{a, b, Expr(std::forward<Args>(rest))...} {}
  Tuple(const FuncRef& ref);  // all values of a Func at a point

  size_t size() const { return exprs_.size(); }  // how many elements
  // Requires: elements are numbered from 0.
  Expr& operator[](size_t i);  // one element
  Expr operator[](size_t i) const;
  const std::vector<Expr>& as_vector() const { return exprs_; }  // all elements

 private:
  void check_index(size_t i) const;
  std::vector<Expr> exprs_;
};

}  // namespace retrograde
