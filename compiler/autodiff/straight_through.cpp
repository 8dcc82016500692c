#include "autodiff/straight_through.h"

#include "diagnostics/error.h"
#include "frontend/language/expr_ops.h"
#include "ir/build.h"

namespace retrograde {

Expr straight_through(const Expr& value, const Expr& surrogate) {
  if (!value.defined() || !surrogate.defined() || !value.type().is_float() ||
      value.type() != surrogate.type()) {
    auto type = [](const Expr& e) { return e.defined() ? to_string(e.type()) : "undefined"; };
    user_error("make a straight-through form", "the value and its surrogate are floats of one type",
               text("they are ", type(value), " and ", type(surrogate)), "Cast one of them");
  }
  // The difference is 0 and its derivative is that of the surrogate. strict_float: contracted to an FMA, it would be
  // the rounding error of the surrogate's last product.
  Expr nothing = strict_float(surrogate - stop_gradient(surrogate));
  return strict_float(stop_gradient(value) + nothing);
}

}  // namespace retrograde
