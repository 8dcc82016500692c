// func_ref.h -- a Func at a point: read as an Expr, or written with = and +=.
#pragma once

#include <vector>

#include "frontend/expr_ops.h"
#include "frontend/function.h"
#include "frontend/stage.h"
#include "frontend/tuple.h"

namespace retrograde {

class FuncTupleElementRef;

// f(x, y). Assigning to it for the first time defines f at all points; after that it adds an update
// definition. f(x) += e on an undefined f first defines it as 0 (for *= and /= as 1) everywhere.
class FuncRef {
 public:
  FuncRef(ir::FuncPtr func, std::vector<Expr> args)
      : func_(std::move(func)), args_(std::move(args)) {}

  Stage operator=(const Expr& value);
  Stage operator=(const Tuple& values);
  Stage operator=(const FuncRef& value);
  FuncRef(const FuncRef&) = default;
#define RETROGRADE_UPDATE(op)      \
  Stage operator op(Expr value);   \
  Stage operator op(const Tuple&); \
  Stage operator op(const FuncRef& value);
  RETROGRADE_UPDATE(+=)
  RETROGRADE_UPDATE(-=)
  RETROGRADE_UPDATE(*=)
  RETROGRADE_UPDATE(/=)
#undef RETROGRADE_UPDATE

  operator Expr() const;                        // of a Func with one value
  FuncTupleElementRef operator[](int i) const;  // one value of a Tuple-valued Func
  size_t size() const;                          // number of values
  const ir::FuncPtr& function() const { return func_; }

  // One value of the Func here, whatever their number.
  Expr element(int i) const;

 private:
  friend class FuncTupleElementRef;
  using Combine = Expr (*)(Expr, Expr);
  std::vector<Expr> left_args(const std::vector<Expr>& values) const;
  Stage define(const std::vector<Expr>& values);
  Stage update(const std::vector<Expr>& values, int initial, Combine combine);
  void define_initial(const std::vector<Expr>& args, const std::vector<Expr>& values,
                      int initial) const;

  ir::FuncPtr func_;
  std::vector<Expr>
      args_;  // as written: the placeholder _ is expanded when it is known for how many
};

inline Expr min(const FuncRef& a, const FuncRef& b) { return min(Expr(a), Expr(b)); }
inline Expr max(const FuncRef& a, const FuncRef& b) { return max(Expr(a), Expr(b)); }
// An Expr of Funcs with one value; tuple_select takes Tuples.
inline Expr select(const Expr& condition, const FuncRef& t, const FuncRef& f) {
  return select(condition, Expr(t), Expr(f));
}
template <typename... Rest>
requires(sizeof...(Rest) >= 1 && (std::is_convertible_v<Rest, Expr> && ...)) Expr
    select(const Expr& c0, const FuncRef& v0, const Expr& c1, const FuncRef& v1, Rest&&... rest) {
  return select(c0, Expr(v0), select(c1, Expr(v1), Expr(std::forward<Rest>(rest))...));
}

// f(x)[1]: assigning to it updates one value and leaves the others of the point alone.
class FuncTupleElementRef {
 public:
  FuncTupleElementRef(FuncRef ref, int index);
  FuncTupleElementRef(const FuncTupleElementRef&) = default;
  Stage operator=(const Expr& value);
  Stage operator=(const FuncRef& value) { return *this = Expr(value); }
  Stage operator=(const FuncTupleElementRef& value) { return *this = Expr(value); }
  Stage operator+=(const Expr& value) { return *this = Expr(*this) + value; }
  Stage operator-=(const Expr& value) { return *this = Expr(*this) - value; }
  Stage operator*=(const Expr& value) { return *this = Expr(*this) * value; }
  Stage operator/=(const Expr& value) { return *this = Expr(*this) / value; }
  operator Expr() const { return ref_.element(index_); }
  int index() const { return index_; }
  const ir::FuncPtr& function() const { return ref_.function(); }

 private:
  FuncRef ref_;
  int index_;
};

}  // namespace retrograde
