// inline_reductions.h -- reductions inside expressions.
//
//   g(x) = sum(f(x + r))   =>   Func s;  s(x) = 0;  s(x) += f(x + r);  g(x) = s(x)
//
// Reduces over the RDom whose variables the expression uses, or over the one given; other variables
// of the expression, reduction variables of enclosing reductions included, become arguments of the
// Func that is made. The result has the type of the expression. A Func given last is the one that
// is defined, so that it can be scheduled.
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
  /* a literal 0 names nothing */                                                \
  template <frontend::ReducedValue E>                                            \
  Result name(const E& e, std::nullptr_t) = delete;                              \
  Result name(const RDom& domain, Expr e, std::nullptr_t) = delete;              \
  Result name(Expr e, const Func& func);                                         \
  Result name(const RDom& domain, Expr e, const Func& func);
RETROGRADE_INLINE_REDUCTION(Expr, sum)
RETROGRADE_INLINE_REDUCTION(Expr, saturating_sum)  // each step clamped to the range of the type
RETROGRADE_INLINE_REDUCTION(Expr, product)
RETROGRADE_INLINE_REDUCTION(Expr, maximum)
RETROGRADE_INLINE_REDUCTION(Expr, minimum)
// The coordinates of the first extreme element in the order of the domain, and then its value.
RETROGRADE_INLINE_REDUCTION(Tuple, argmax)
RETROGRADE_INLINE_REDUCTION(Tuple, argmin)
#undef RETROGRADE_INLINE_REDUCTION

}  // namespace retrograde
