#include "frontend/language/integer_ops.h"

#include <algorithm>

#include "frontend/language/operand_checks.h"
#include "ir/literal.h"
#include "ir/print.h"

namespace retrograde {

Expr user_context_value() {
  return ir::call_op(ir::Op::runtime_call, Handle(), {Expr("retrograde_user_context")});
}

namespace {

// The operands of a division, cast to a signed type that holds both; the divisor is in [1, 256].
struct Division {
  Type type;  // of the result
  Expr numerator, divisor;

  Division(const Expr& n, const Expr& d, const char* what) {
    frontend::check_defined(n, what);
    frontend::check_defined(d, what);
    const std::string asked = text("apply ", what, " to ", n, " and ", d);
    if (!n.type().is_int_or_uint() || n.type().bits() < 8 || n.type().bits() > 32) {
      user_error(asked, "the numerator is an integer of 8, 16 or 32 bits",
                 "its type is " + to_string(n.type()), "Use operator/ and operator%");
    }
    const Type byte = UInt(8);
    if (!ir::is_const(d) && d.type().element_of() != byte) {
      user_error(asked, "the divisor is of type uint8", "its type is " + to_string(d.type()),
                 "Cast it to uint8");
    }
    const Expr small = ir::literal_in(byte, d, asked, "the divisor is of type uint8");
    type = n.type().element_of();
    const Type wide = Int(type.bits() == 32 ? 64 : 32);
    numerator = cast(wide, n);
    divisor = select(small == 0, ir::make_const(wide, 256), cast(wide, small));
  }

  Expr result(const Expr& e) const { return cast(type, e); }
};

}  // namespace

Expr fast_integer_divide(const Expr& numerator, const Expr& divisor) {
  const Division d(numerator, divisor, "fast_integer_divide");
  return d.result(d.numerator / d.divisor);
}

Expr fast_integer_modulo(const Expr& numerator, const Expr& divisor) {
  const Division d(numerator, divisor, "fast_integer_modulo");
  return d.result(d.numerator % d.divisor);
}

Expr fast_integer_divide_round_to_zero(const Expr& numerator, const Expr& divisor) {
  const Division d(numerator, divisor, "fast_integer_divide_round_to_zero");
  return d.result(div_round_to_zero(d.numerator, d.divisor));
}

namespace {

// A literal takes the type of the other operand and must fit it, as in a + 300.
Type match_operands(Expr& a, Expr& b, const char* what) {
  const bool is_literal_a = ir::is_const(a), is_literal_b = ir::is_const(b);
  if (is_literal_a != is_literal_b && a.defined() && b.defined()) {
    Expr& literal = is_literal_a ? a : b;
    const Type type = is_literal_a ? b.type() : a.type();
    if (literal.type() == Int(32)) {
      literal = ir::literal_in(type, literal, text("apply ", what, " to ", a, " and ", b),
                               "a constant takes the type of the other operand and must fit it");
    }
  }
  ir::match_types(a, b, what);
  return a.type();
}

}  // namespace

// ---- widening ----

namespace {

void check_integers(const Expr& a, const Expr& b, const char* what) {
  frontend::check_defined(a, what);
  frontend::check_defined(b, what);
  frontend::check_integer(a, what);
  frontend::check_integer(b, what);
}

int widest(const Expr& a, const Expr& b) { return std::max(a.type().bits(), b.type().bits()); }

Type wide_type(const Expr& a, const Expr& b, const char* what) {
  frontend::check_defined(a, what);
  frontend::check_defined(b, what);
  const int bits = 2 * widest(a, b);
  if (bits > 64) {
    user_error(text("apply ", what, " to ", a, " and ", b), "its result has at most 64 bits",
               text("their types are ", to_string(a.type()), " and ", to_string(b.type())),
               "Cast them to 32 bits");
  }
  const bool is_signed = a.type().is_int() || b.type().is_int();
  return a.type().is_float() || b.type().is_float() ? Float(bits)
         : is_signed                                ? Int(bits)
                                                    : UInt(bits);
}

}  // namespace

Expr widening_mul(const Expr& a, const Expr& b) {
  const Type wide = wide_type(a, b, "widening_mul");
  return cast(wide, a) * cast(wide, b);
}

Expr widening_add(const Expr& a, const Expr& b) {
  const Type wide = wide_type(a, b, "widening_add");
  return cast(wide, a) + cast(wide, b);
}

Expr widening_sub(const Expr& a, const Expr& b) {
  Type wide = wide_type(a, b, "widening_sub");
  if (wide.is_uint()) wide = wide.with_code(TypeCode::Int);
  return cast(wide, a) - cast(wide, b);
}

// ---- saturating ----

Expr saturating_add(const Expr& a, const Expr& b) {
  check_integers(a, b, "saturating_add");
  return saturating_cast(a.type(), widening_add(a, b));
}

Expr saturating_sub(const Expr& a, const Expr& b) {
  check_integers(a, b, "saturating_sub");
  return saturating_cast(a.type(), widening_sub(a, b));
}

// ---- shifts ----

namespace {

Type wide_like(const Expr& a, const Expr& b, const char* what) {
  check_integers(a, b, what);
  return wide_type(a, a, what).with_code(a.type().code());
}

// Adds the highest bit that is shifted out. This cannot overflow, unlike (e + half) >> amount.
Expr rounded_shift(const Expr& e, const Expr& amount) {
  const Expr one = ir::make_one(amount.type()), zero = ir::make_zero(amount.type());
  const Expr lost = (e >> (amount - one)) & ir::make_one(e.type());
  return (e >> amount) + select(amount > zero, lost, ir::make_zero(e.type()));
}

Expr negated(const Expr& e) {
  const Type type = Int(std::min(64, e.type().bits() * (e.type().is_int() ? 1 : 2)));
  return -cast(type, e);
}

}  // namespace

Expr widening_shift_left(const Expr& a, const Expr& b) {
  return cast(wide_like(a, b, "widening_shift_left"), a) << b;
}

Expr widening_shift_right(const Expr& a, const Expr& b) {
  return cast(wide_like(a, b, "widening_shift_right"), a) >> b;
}

Expr rounding_shift_right(const Expr& a, const Expr& b) {
  const Type wide = wide_like(a, b, "rounding_shift_right");
  return saturating_cast(a.type(), rounded_shift(cast(wide, a), b));
}

Expr rounding_shift_left(const Expr& a, const Expr& b) {
  const Type wide = wide_like(a, b, "rounding_shift_left");
  return saturating_cast(a.type(), rounded_shift(cast(wide, a), negated(b)));
}

Expr mul_shift_right(const Expr& a, const Expr& b, const Expr& q) {
  check_integers(a, b, "mul_shift_right");
  check_integers(q, q, "mul_shift_right");
  const Expr product = widening_mul(a, b);
  return saturating_cast(product.type().with_bits(product.type().bits() / 2), product >> q);
}

Expr rounding_mul_shift_right(const Expr& a, const Expr& b, const Expr& q) {
  check_integers(a, b, "rounding_mul_shift_right");
  check_integers(q, q, "rounding_mul_shift_right");
  const Expr product = widening_mul(a, b);
  const Type narrow = product.type().with_bits(product.type().bits() / 2);
  return saturating_cast(narrow, rounded_shift(product, q));
}

// ---- one narrow operand ----

namespace {

Expr widened_like(const Expr& a, const Expr& b, const char* what) {
  check_integers(a, b, what);
  if (2 * b.type().bits() != a.type().bits()) {
    user_error(text("apply ", what, " to ", a, " and ", b),
               "the second operand has half the bits of the first",
               text("their types are ", to_string(a.type()), " and ", to_string(b.type())),
               "Cast one of them, or use the operator");
  }
  return cast(a.type(), b);
}

}  // namespace

Expr widen_right_add(const Expr& a, const Expr& b) {
  return a + widened_like(a, b, "widen_right_add");
}
Expr widen_right_mul(const Expr& a, const Expr& b) {
  return a * widened_like(a, b, "widen_right_mul");
}
Expr widen_right_sub(const Expr& a, const Expr& b) {
  return a - widened_like(a, b, "widen_right_sub");
}

// ---- means: 64-bit operands use a = 2 (a >> 1) + (a & 1), so that no sum overflows ----

Expr halving_add(Expr a, Expr b) {
  const Type type = match_operands(a, b, "halving_add");
  check_integers(a, b, "halving_add");
  if (type.bits() < 64) return cast(type, widening_add(a, b) / 2);
  return (a & b) + ((a ^ b) >> 1);
}

Expr rounding_halving_add(Expr a, Expr b) {
  const Type type = match_operands(a, b, "rounding_halving_add");
  check_integers(a, b, "rounding_halving_add");
  if (type.bits() < 64) return cast(type, (widening_add(a, b) + 1) / 2);
  return (a | b) - ((a ^ b) >> 1);
}

Expr halving_sub(Expr a, Expr b) {
  const Type type = match_operands(a, b, "halving_sub");
  check_integers(a, b, "halving_sub");
  if (type.bits() < 64) return cast(type, widening_sub(a, b) / 2);
  return (a >> 1) - (b >> 1) - (~a & b & 1);
}

// ---- bit fields ----

Expr extract_bits(Type type, const Expr& e, const Expr& lowest) {
  frontend::check_defined(e, "extract_bits");
  frontend::check_integer(lowest, "extract_bits");
  const Type bits = e.type().with_code(TypeCode::UInt);
  return reinterpret(
      type, cast(type.with_code(TypeCode::UInt), reinterpret(bits, e) >> cast(bits, lowest)));
}

Expr concat_bits(const std::vector<Expr>& parts) {
  const std::string asked = "concatenate bits";
  if (parts.empty())
    user_error(asked, "there is at least one part", "none was given",
               "Give the parts, the lowest first");
  int total = 0;
  for (const Expr& part : parts) {
    if (!part.defined())
      user_error(asked, "every part is a defined expression", "one was never assigned",
                 "Assign every Expr before it is used");
    if (part.type() != parts[0].type()) {
      user_error(asked, "all parts have one type",
                 to_string(parts[0].type()) + " and " + to_string(part.type()) + " were given",
                 "Cast them");
    }
    total += part.type().bits();
  }
  if (total != 8 && total != 16 && total != 32 && total != 64) {
    user_error(asked, "the result has 8, 16, 32 or 64 bits", text("it would have ", total),
               "Give another number of parts");
  }
  const Type result_type = UInt(total), part_bits = parts[0].type().with_code(TypeCode::UInt);
  Expr result;
  for (size_t i = 0; i < parts.size(); i++) {
    const Expr bits = cast(result_type, reinterpret(part_bits, parts[i]));
    const Expr placed = bits << cast(result_type, static_cast<int>(i) * part_bits.bits());
    result = result.defined() ? result | placed : placed;
  }
  return result;
}

}  // namespace retrograde
