// inline_reductions.h -- reductions inside expressions.
//
//   g(x) = sum(f(x + r))   =>   Func s;  s(x) = 0;  s(x) += f(x + r);  g(x) = s(x)
//
// A reduction runs over the RDom whose variables the expression uses, or over the one that is passed. Other variables
// of the expression, reduction variables of enclosing reductions included, become arguments of the new Func. The
// result has the type of the expression. To schedule the reduction, pass a Func as the last argument; it is defined
// instead of an anonymous one.
#pragma once

#include <string>

#include "frontend/language/func.h"

namespace retrograde {

namespace frontend {
template <typename E>
concept ReducedValue = std::is_convertible_v<E, Expr> && !std::is_convertible_v<E, const RDom&>;
}

// Requires: the expression must be defined; it runs over one RDom; the expression must use a
// reduction variable; the Func that is given must have no definition.
#define RETROGRADE_INLINE_REDUCTION(Result, name)                                \
  Result name(Expr e, const std::string& func_name = #name);                     \
  Result name(const RDom& domain, Expr e, const std::string& func_name = #name); \
  /* a literal 0 is not a name */                                                \
  template <frontend::ReducedValue E>                                            \
  Result name(const E& e, std::nullptr_t) = delete;                              \
  Result name(const RDom& domain, Expr e, std::nullptr_t) = delete;              \
  Result name(Expr e, const Func& func);                                         \
  Result name(const RDom& domain, Expr e, const Func& func);
RETROGRADE_INLINE_REDUCTION(Expr, sum)  // sum over the domain
// Sum over the domain, clamped after each step to the range of the type.
RETROGRADE_INLINE_REDUCTION(Expr, saturating_sum)
RETROGRADE_INLINE_REDUCTION(Expr, product)  // product over the domain
RETROGRADE_INLINE_REDUCTION(Expr, maximum)  // largest value
RETROGRADE_INLINE_REDUCTION(Expr, minimum)  // smallest value
// Coordinates of the first largest element in the order of the domain, followed by its value.
RETROGRADE_INLINE_REDUCTION(Tuple, argmax)
// Coordinates of the first smallest element in the order of the domain, followed by its value.
RETROGRADE_INLINE_REDUCTION(Tuple, argmin)
#undef RETROGRADE_INLINE_REDUCTION

}  // namespace retrograde
