#include "lower/definitions/strict_indices.h"

#include <functional>

#include "analysis/interval.h"
#include "analysis/nonnegative.h"
#include "ir/build.h"
#include "ir/visit.h"

namespace retrograde::lower {

namespace {

bool reads_element(const Expr& e) {
  const auto* call = e.as<Call>();
  return call && (call->call_type == CallType::Func || call->call_type == CallType::Image);
}

// Whether e contains a float sum and a float product that could be contracted; elements that e reads count as values.
bool may_contract(const Expr& e) {
  bool sum = false, product = false;
  walk(e, [&](const Expr& part) {
    if (reads_element(part)) return false;
    const bool is_lerp = as_op(part, Op::lerp);
    if (part.type().is_float()) {
      sum |= part.kind() == Kind::Add || part.kind() == Kind::Sub || is_lerp;
      product |= part.kind() == Kind::Mul || is_lerp || as_op(part, Op::strong_mul);
    }
    return !(sum && product);
  });
  return sum && product;
}

bool may_be_negative_as_nan(const Expr& value, Type type) {
  return type.is_int() && is_nonnegative_or_nan(value) &&
         !bounds_of(value, Scope<Interval>()).has_lower_bound();
}

// Makes a coordinate strict, down to the elements that it reads.
Expr strict_coordinate(const Expr& e, const std::function<Expr(const Expr&)>& recurse) {
  if (reads_element(e)) return e;
  const auto* cast = e.as<Cast>();
  if (!cast || !cast->type.is_int_or_uint() || !cast->value.type().is_float()) return {};
  const Expr& value = cast->value;
  const Expr place = may_contract(value)
                         ? cast_to(cast->type, call_op(Op::strict_float, value.type(), {value}))
                         : map_children(e, recurse);
  return may_be_negative_as_nan(value, cast->type) ? max(place, make_zero(cast->type)) : place;
}

}  // namespace

void make_indices_strict(Program& program) {
  StepRewriter coordinate(strict_coordinate);
  StepRewriter strict([&](const Expr& e, const auto& recurse) {
    return reads_element(e) ? map_children(map_children(e, recurse), coordinate) : Expr();
  });
  for (LoopedFunc& f : program.funcs) {
    for (Definition& stage : f.stages) {
      stage = map_exprs(stage, std::ref(strict));
      for (Expr& arg : stage.args) arg = coordinate(arg);
    }
  }
}

}  // namespace retrograde::lower
