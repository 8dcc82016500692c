// expr_ops.cpp -- type rules and checks of the operators and functions on Exprs.
#include "frontend/language/expr_ops.h"

#include "frontend/language/operand_checks.h"
#include "graph/definitions/random_sequence.h"
#include "ir/literal.h"
#include "ir/print.h"

namespace retrograde {

using frontend::check_defined;
using frontend::check_integer;
using frontend::type_error;
using ir::call_op;
using ir::Op;

void frontend::type_error(const char* what, const std::string& rule, const Expr& e,
                          const std::string& instead) {
  user_error(text("apply ", what, " to ", e), rule, "its type is " + to_string(e.type()), instead);
}

void frontend::check_defined(const Expr& e, const char* what) {
  if (e.defined()) return;
  user_error(text("apply ", what), "every operand must be a defined expression",
             "one of them was never assigned", "Assign the Expr before its use");
}

void frontend::check_integer(const Expr& e, const char* what) {
  check_defined(e, what);
  if (!e.type().is_int_or_uint()) type_error(what, "it takes integers", e);
}

namespace {

void match_integers(Expr& a, Expr& b, const char* what) {
  check_integer(a, what);
  check_integer(b, what);
  ir::match_types(a, b, what);
}

Expr bitwise(Op op, Expr a, Expr b) {
  match_integers(a, b, ir::op_info(op).name);
  return call_op(op, {a, b});
}

Expr shift(Op op, Expr a, Expr b) {
  const char* name = ir::op_info(op).name;
  check_integer(a, name);
  check_integer(b, name);
  // The saturating cast keeps the sign of the amount. An amount too large for the width of `a` stays at least as
  // large as that width.
  b = saturating_cast(b.type().with_bits(a.type().bits()), b);
  if (a.type().lanes() != b.type().lanes()) {
    if (a.type().is_scalar()) a = ir::make_broadcast(a, b.type().lanes());
    if (b.type().is_scalar()) b = ir::make_broadcast(b, a.type().lanes());
  }
  return call_op(op, a.type(), {a, b});
}

Expr marked(Op op, const Expr& e) {
  check_defined(e, ir::op_info(op).name);
  return call_op(op, {e});
}

Type unsigned_form(Type type) { return type.is_int() ? type.with_code(TypeCode::UInt) : type; }

// Calls without a seed draw from different streams.
Expr random(Type type, Expr seed) {
  if (!seed.defined()) {
    seed = Expr(int32_t{-1} - graph::next_random_stream());
  } else if (!seed.type().is_int_or_uint() || !seed.type().is_scalar()) {
    type_error("random", "its seed is an integer", seed);
  }
  return call_op(Op::random, type, {ir::cast_to(Int(32), seed)});
}

void check_condition(const Expr& condition, const char* what) {
  check_defined(condition, what);
  if (!condition.type().is_bool())
    type_error(what, "its condition is of type bool", condition, "Compare it with something");
}

}  // namespace

Expr operator&(Expr a, Expr b) { return bitwise(Op::bitwise_and, std::move(a), std::move(b)); }
Expr operator|(Expr a, Expr b) { return bitwise(Op::bitwise_or, std::move(a), std::move(b)); }
Expr operator^(Expr a, Expr b) { return bitwise(Op::bitwise_xor, std::move(a), std::move(b)); }
Expr operator~(Expr a) {
  check_integer(a, "bitwise_not");
  return call_op(Op::bitwise_not, {a});
}
Expr operator<<(Expr a, Expr b) { return shift(Op::shift_left, std::move(a), std::move(b)); }
Expr operator<<(Expr a, int b) { return shift(Op::shift_left, std::move(a), Expr(b)); }
Expr operator>>(Expr a, Expr b) { return shift(Op::shift_right, std::move(a), std::move(b)); }
Expr operator>>(Expr a, int b) { return shift(Op::shift_right, std::move(a), Expr(b)); }

Expr saturating_cast(Type type, Expr value) {
  check_defined(value, "saturating_cast");
  if (type.is_handle() || value.type().is_handle())
    type_error("saturating_cast", "it takes and gives numbers", value);
  type = type.with_lanes(value.type().lanes());
  if (type == value.type()) return value;
  return call_op(Op::saturating_cast, type, {value});
}

Expr reinterpret(Type type, Expr value) {
  check_defined(value, "reinterpret");
  if (type.bits() * type.lanes() != value.type().bits() * value.type().lanes()) {
    user_error(text("reinterpret ", value, " as ", to_string(type)), "both types are equally wide",
               text("its type is ", to_string(value.type())), "Use cast<>() to convert the value");
  }
  return ir::reinterpret_as(type, std::move(value));
}

Tuple select(const Tuple& condition, const Tuple& when_true, const Tuple& when_false) {
  if (condition.size() != when_true.size() || when_true.size() != when_false.size()) {
    user_error("select between Tuples", "all Tuples have one size",
               text("they have ", condition.size(), ", ", when_true.size(), " and ",
                    when_false.size(), " elements"),
               "Give Tuples of one size");
  }
  return Tuple(ir::numbered(condition.size(), [&](size_t i) {
    return select(condition[i], when_true[i], when_false[i]);
  }));
}

Tuple select(const Expr& condition, const Tuple& when_true, const Tuple& when_false) {
  return select(Tuple(std::vector<Expr>(when_true.size(), condition)), when_true, when_false);
}

Expr mux(const Expr& id, const std::vector<Expr>& values) {
  if (values.empty())
    user_error("apply mux", "it chooses among at least one value", "the list is empty",
               "Give the values");
  Expr result = values.back();
  for (size_t i = values.size() - 1; i-- > 0;)
    result = select(id == static_cast<int>(i), values[i], result);
  return result;
}

Expr mux(const Expr& id, const std::initializer_list<Expr>& values) {
  return mux(id, std::vector<Expr>(values));
}
Expr mux(const Expr& id, const Tuple& values) { return mux(id, values.as_vector()); }

Expr abs(Expr x) {
  check_defined(x, "abs");
  if (x.type().is_handle()) type_error("abs", "it takes a number", x);
  if (x.type().is_uint()) return x;
  return call_op(Op::abs, unsigned_form(x.type()), {x});
}

Expr absd(Expr a, Expr b) {
  check_defined(a, "absd");
  check_defined(b, "absd");
  ir::match_types(a, b, "absd");
  return call_op(Op::absd, unsigned_form(a.type()), {a, b});
}

namespace {

// A constant whose type is the one that C++ gives to literals, so the type does not show the user's intent.
bool is_literal(const Expr& e) {
  const Type type = e.type();
  return ir::is_const(e) && type.is_scalar() &&
         (type == Int(32) || type == Float(32) || type == Float(64));
}

// A literal takes the type of the other end; a float literal only takes another floating-point type.
void match_ends(Expr& zero, Expr& one) {
  const std::string asked = text("apply lerp to ", zero, " and ", one);
  const auto match = [&](Expr& end, const Expr& other) {
    if (is_literal(end) && (end.type().is_int() || other.type().is_float()))
      end = ir::literal_in(other.type(), end, asked,
                           "a constant end takes the type of the other and must fit it");
  };
  if (is_literal(zero) && is_literal(one)) {
    ir::match_types(zero, one, "lerp");
  } else {
    match(zero, one);
    match(one, zero);
  }
  if (zero.type() != one.type()) {
    user_error(asked, "both values have one type",
               text("they are ", to_string(zero.type()), " and ", to_string(one.type())),
               "Cast one of them");
  }
  if (!zero.type().is_int_or_uint() || zero.type().bits() < 64) return;
  user_error(asked, "integers are of at most 32 bits", "their type is " + to_string(zero.type()),
             "Cast them to double, or write zero + (one - zero) * weight");
}

// The integer literals 0 and 1 are valid weights too.
Expr checked_weight(const Expr& zero, Expr weight) {
  const auto constant = ir::as_const_int(weight);
  const bool is_end = constant && weight.type() == Int(32) && (*constant == 0 || *constant == 1);
  if (is_end) weight = ir::cast_to(Float(32), weight);
  if (!weight.type().is_uint() && !weight.type().is_float()) {
    type_error("lerp", "its weight is a float or an unsigned integer", weight);
  }
  const auto value = ir::as_const_float(weight);
  if (value && !zero.type().is_float() && !(*value >= 0 && *value <= 1)) {
    user_error(text("apply lerp with the weight ", *value),
               "integers are interpolated with weights in [0, 1]",
               text("the ends are ", to_string(zero.type()), ", and the weight is ", *value),
               "Give a weight in [0, 1], or interpolate floats");
  }
  if (!zero.type().is_float()) return weight;
  if (weight.type().is_float()) return ir::cast_to(zero.type(), weight);
  const auto largest = static_cast<double>(weight.type().max_uint());
  return ir::cast_to(zero.type(), weight) / ir::make_const(zero.type(), largest);
}

}  // namespace

// Integers of n bits are interpolated with a weight w / (2^n - 1). The given weight is converted to w by rounding down;
// a float weight is multiplied by 2^n - 1 in float, or in double for 32 bits. The result is rounded to nearest.
Expr lerp(Expr zero, Expr one, Expr weight) {
  check_defined(zero, "lerp");
  check_defined(one, "lerp");
  check_defined(weight, "lerp");
  match_ends(zero, one);
  weight = checked_weight(zero, std::move(weight));
  const Type type = zero.type();
  return call_op(Op::lerp, type, {zero, one, weight});
}

Expr div_round_to_zero(Expr a, Expr b) {
  match_integers(a, b, "div_round_to_zero");
  if (a.type().is_uint()) return a / b;
  // Floor division of magnitudes, then the sign.
  Expr magnitude = cast(a.type(), abs(a) / abs(b));
  return select((a < 0) != (b < 0), -magnitude, magnitude);
}

Expr mod_round_to_zero(Expr a, Expr b) {
  match_integers(a, b, "mod_round_to_zero");
  if (a.type().is_uint()) return a % b;
  Expr magnitude = cast(a.type(), abs(a) % abs(b));
  return select(a < 0, -magnitude, magnitude);
}

#define RETROGRADE_COUNT_BITS(name) \
  Expr name(Expr x) {               \
    check_integer(x, #name);        \
    return call_op(Op::name, {x});  \
  }
RETROGRADE_COUNT_BITS(popcount)
RETROGRADE_COUNT_BITS(count_leading_zeros)
RETROGRADE_COUNT_BITS(count_trailing_zeros)
#undef RETROGRADE_COUNT_BITS

Expr random_float(Expr seed) { return random(Float(32), std::move(seed)); }
Expr random_uint(Expr seed) { return random(UInt(32), std::move(seed)); }
Expr random_int(Expr seed) { return random(Int(32), std::move(seed)); }

Expr likely_if_innermost(Expr e) { return marked(Op::likely_if_innermost, e); }

Expr unsafe_promise_clamped(const Expr& value, const Expr& min, const Expr& max) {
  check_defined(value, "unsafe_promise_clamped");
  const Type type = value.type();
  return call_op(Op::unsafe_promise_clamped, type,
                 {value, min.defined() ? cast(type, min) : type.min(),
                  max.defined() ? cast(type, max) : type.max()});
}

Expr strict_float(Expr e) { return marked(Op::strict_float, e); }

Expr memoize_tag(Expr value, const std::vector<Expr>& key) {
  check_defined(value, "memoize_tag");
  std::vector<Expr> args = {std::move(value)};
  for (const Expr& part : key) {
    check_defined(part, "memoize_tag");
    args.push_back(part);
  }
  const Type type = args[0].type();
  return call_op(Op::memoize_tag, type, std::move(args));
}

Expr stop_gradient(Expr e) { return marked(Op::stop_gradient, e); }

Expr undef(Type type) { return call_op(Op::undef, type, {}); }

namespace frontend {

namespace {

// A call with the arguments `first` and then `values`, whose result is the first of `values`.
Expr call_with(Op op, std::vector<Expr> first, const std::vector<Expr>& values) {
  const char* what = op_info(op).name;
  for (const Expr& condition : first) check_condition(condition, what);
  if (values.empty())
    user_error(text("apply ", what), "it returns its first argument", "it was given none",
               "Give it a value");
  for (const Expr& value : values) check_defined(value, what);
  first.insert(first.end(), values.begin(), values.end());
  return call_op(op, values[0].type(), std::move(first));
}

}  // namespace

Expr print_values(std::vector<Expr> values) { return call_with(Op::print, {}, values); }

Expr print_values_when(Expr condition, std::vector<Expr> values) {
  return call_with(Op::print_when, {std::move(condition)}, values);
}

Expr require_values(Expr condition, std::vector<Expr> values) {
  return call_with(Op::require, {std::move(condition)}, values);
}

}  // namespace frontend
}  // namespace retrograde
