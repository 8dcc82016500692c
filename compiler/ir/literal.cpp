// Decides which constants keep their value in another type.
#include "ir/literal.h"

#include <cmath>

#include "diagnostics/error.h"
#include "ir/build.h"

namespace retrograde::ir {

bool holds_value(Type type, const Scalar& value) {
  if (type.is_handle() || value.type.is_handle()) return type.is_handle() == value.type.is_handle();
  if (value.type.is_float()) return type.can_represent(value.f);
  if (type.is_float()) {
    const double rounded = eval_cast(type, value).f;
    if (!std::isfinite(rounded)) return false;
    const __int128 exact = value.type.is_int() ? __int128{value.i} : __int128{value.u};
    return static_cast<__int128>(rounded) == exact;
  }
  return value.type.is_int() ? type.can_represent(value.i) : type.can_represent(value.u);
}

std::string literal_text(const Scalar& value) {
  if (value.type.is_float()) return text(value.f);
  return value.type.is_int() ? text(value.i) : text(value.u);
}

Expr literal_in(Type type, Expr e, const std::string& asked, const std::string& rule) {
  const std::optional<Scalar> value = as_scalar(e);
  if (value && !holds_value(type.element_of(), *value)) {
    const std::string name = to_string(type.element_of());
    user_error(asked, rule, text(literal_text(*value), " does not fit ", name),
               text("Give a value of ", name, ", or cast both sides to a wider type"));
  }
  return cast_to(type, std::move(e));
}

Expr int32_literal(Expr e, const std::string& asked) {
  return literal_in(Int(32), std::move(e), asked, "sizes and coordinates are of 32 bits");
}

bool always_fits(Type type, const Expr& e) {
  if (const std::optional<Scalar> value = as_scalar(e))
    return holds_value(type.element_of(), *value);
  if (type.element_of().can_represent(e.type().element_of())) return true;
  const Cast* cast = e.as<Cast>();
  return cast && e.type().element_of().can_represent(cast->value.type().element_of()) &&
         always_fits(type, cast->value);
}

}  // namespace retrograde::ir
