// func_ref.h -- a Func at a point: read as an Expr, or written with = and +=.
#pragma once

#include <vector>

#include "frontend/language/expr_ops.h"
#include "frontend/language/function_handle.h"
#include "frontend/language/tuple.h"
#include "frontend/schedule/stage.h"
#include "graph/function.h"

namespace retrograde {

class FuncTupleElementRef;

// f(x, y). Assigning to it for the first time defines f at all points; after that it adds an update
// definition. f(x) += e on an undefined f first defines it as 0 (for *= and /= as 1) everywhere.
// A text as a value is the address of its characters, which live as long as the compiled code.
class FuncRef {
 public:
  FuncRef(graph::FuncPtr func, std::vector<Expr> args)
      : func_(std::move(func)), args_(std::move(args)) {}

  // Requires: every argument on the left-hand side must be a defined expression; a definition has
  // at least one value; the right-hand side must be a defined expression; a Func is defined once; a
  // first definition has no reduction variables; the arguments of a first definition are Vars; the
  // arguments of a first definition are different Vars; a definition has the dimensions that the
  // Func was declared with; a right-hand side that uses _ needs _ on the left-hand side; every
  // variable on the right-hand side appears on the left-hand side, or belongs to an RDom; a
  // parameter and a pure variable of one definition have different names; constants of int32 and
  // int64 do not overflow.
  Stage operator=(const Expr& value);
  Stage operator=(const Tuple& values);
  Stage operator=(const FuncRef& value);
  FuncRef(const FuncRef&) = default;
// Requires: a Func is updated after its first definition; all definitions of a Func have the same
// number of arguments; coordinates are integers; all definitions of a Func have the same number of
// values; all definitions of a Func have the same types; all reduction variables of one definition
// come from one RDom; a pure variable keeps its position in every reference of a Func to itself, so
// that its iterations are independent; the bounds of a reduction domain are known before its update
// runs; a Func that a C function computes has no updates; a Func is complete when another Func uses
// it.
#define RETROGRADE_UPDATE(op)      \
  Stage operator op(Expr value);   \
  Stage operator op(const Tuple&); \
  Stage operator op(const FuncRef& value);
  RETROGRADE_UPDATE(+=)
  RETROGRADE_UPDATE(-=)
  RETROGRADE_UPDATE(*=)
  RETROGRADE_UPDATE(/=)
#undef RETROGRADE_UPDATE

  // Requires: a Func of several values is a Tuple at each point; a Func is defined before it is
  // read.
  operator Expr() const;                        // of a Func with one value
  FuncTupleElementRef operator[](int i) const;  // one value of a Tuple-valued Func
  size_t size() const;                          // number of values
  internal::Function function() const { return internal::Function(func_); }

  // One value of the Func here, whatever their number.
  // Requires: the values of a point are numbered from 0.
  Expr element(int i) const;

 private:
  friend class FuncTupleElementRef;
  using Combine = Expr (*)(Expr, Expr);
  std::vector<Expr> left_args(const std::vector<Expr>& values) const;
  Stage define(const std::vector<Expr>& values);
  Stage update(const std::vector<Expr>& values, int initial, Combine combine);
  void define_initial(const std::vector<Expr>& args, const std::vector<Expr>& values,
                      int initial) const;

  graph::FuncPtr func_;
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
  internal::Function function() const { return ref_.function(); }

 private:
  FuncRef ref_;
  int index_;
};

}  // namespace retrograde
