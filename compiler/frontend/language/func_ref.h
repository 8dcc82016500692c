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

// A Func at a point: f(x, y). The first assignment defines f at all points; later ones add update
// definitions. f(x) += e on an undefined f first defines it as 0 everywhere, *= and /= as 1. A
// string as a value is the address of its characters, which live as long as the compiled code.
class FuncRef {
 public:
  // The function `func` at the coordinates `args`.
  FuncRef(graph::FuncPtr func, std::vector<Expr> args)
      : func_(std::move(func)), args_(std::move(args)) {}

  // Defines the Func, or adds an update that overwrites this point.
  // Requires: every argument on the left-hand side must be a defined expression; a definition
  // has at least one value; the right-hand side must be a defined expression; a Func is
  // defined once; a first definition has no reduction variables; the arguments of a first
  // definition are Vars; the arguments of a first definition are different Vars; a definition has
  // the dimensions that the Func was declared
  // with; a right-hand side that uses _ needs _ on the left-hand side; every variable on the
  // right-hand side appears on the left-hand side, or belongs to an RDom; a parameter and a pure
  // variable of one definition have different names; constants of int32 and int64 do not overflow.
  Stage operator=(const Expr& value);
  Stage operator=(const Tuple& values);
  Stage operator=(const FuncRef& value);
  FuncRef(const FuncRef&) = default;
  // Adds an update that combines the value with this point: f(x) += e means f(x) = f(x) + e.
  // Requires: a Func is updated after its first definition; all definitions of a Func have the
  // same number of arguments; coordinates are integers; all definitions of a Func have the same
  // number of values; all definitions of a Func have the same types; all reduction variables of
  // one definition come from one RDom; a pure variable keeps its position in every reference of a
  // Func to itself, so that its iterations are independent; the bounds of a reduction domain are
  // known before its update runs; a Func that a C function computes has no updates; a Func is
  // complete when another Func uses it.
#define RETROGRADE_UPDATE(op)      \
  Stage operator op(Expr value);   \
  Stage operator op(const Tuple&); \
  Stage operator op(const FuncRef& value);
  RETROGRADE_UPDATE(+=)
  RETROGRADE_UPDATE(-=)
  RETROGRADE_UPDATE(*=)
  RETROGRADE_UPDATE(/=)
#undef RETROGRADE_UPDATE

  // The value of a single-valued Func at this point.
  // Requires: a Func of several values is a Tuple at each point; a Func is defined before it is
  // read.
  operator Expr() const;
  FuncTupleElementRef operator[](int i) const;  // value i of a Tuple-valued Func
  size_t size() const;                          // number of values
  // The function that is accessed.
  internal::Function function() const { return internal::Function(func_); }

  // Value i at this point, of a Func with any number of values.
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
      args_;  // as written; the placeholder _ is expanded once the number of dimensions is known
};

// The smaller of two single-valued Funcs at their points.
inline Expr min(const FuncRef& a, const FuncRef& b) { return min(Expr(a), Expr(b)); }
// The larger of two single-valued Funcs at their points.
inline Expr max(const FuncRef& a, const FuncRef& b) { return max(Expr(a), Expr(b)); }
// Selects between single-valued Funcs; tuple_select takes Tuples.
inline Expr select(const Expr& condition, const FuncRef& t, const FuncRef& f) {
  return select(condition, Expr(t), Expr(f));
}
template <typename... Rest>
requires(sizeof...(Rest) >= 1 && (std::is_convertible_v<Rest, Expr> && ...)) Expr
    select(const Expr& c0, const FuncRef& v0, const Expr& c1, const FuncRef& v1, Rest&&... rest) {
  return select(c0, Expr(v0), select(c1, Expr(v1), Expr(std::forward<Rest>(rest))...));
}

// One value of a Tuple-valued Func at a point: f(x)[1]. Assigning to it updates this value and
// leaves the others.
class FuncTupleElementRef {
 public:
  // Value `index` of the Func at a point.
  FuncTupleElementRef(FuncRef ref, int index);
  FuncTupleElementRef(const FuncTupleElementRef&) = default;
  // Adds an update that overwrites this value.
  Stage operator=(const Expr& value);
  Stage operator=(const FuncRef& value) { return *this = Expr(value); }
  Stage operator=(const FuncTupleElementRef& value) { return *this = Expr(value); }
  Stage operator+=(const Expr& value) { return *this = Expr(*this) + value; }  // adds to this value
  // Subtracts from this value.
  Stage operator-=(const Expr& value) { return *this = Expr(*this) - value; }
  // Multiplies this value.
  Stage operator*=(const Expr& value) { return *this = Expr(*this) * value; }
  Stage operator/=(const Expr& value) { return *this = Expr(*this) / value; }  // divides this value
  operator Expr() const { return ref_.element(index_); }                       // the value, to read
  int index() const { return index_; }  // position in the Tuple
  // The function that is accessed.
  internal::Function function() const { return ref_.function(); }

 private:
  FuncRef ref_;
  int index_;
};

}  // namespace retrograde
