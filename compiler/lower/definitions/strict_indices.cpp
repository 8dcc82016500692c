#include "lower/definitions/strict_indices.h"

#include <algorithm>
#include <functional>
#include <unordered_set>

#include "analysis/interval.h"
#include "analysis/nonnegative.h"
#include "graph/definitions/own_reads.h"
#include "ir/build.h"
#include "ir/equal.h"
#include "ir/visit.h"

namespace retrograde::lower {

namespace {

bool reads_element(const Expr& e) {
  const auto* call = e.as<Call>();
  return call && (call->call_type == CallType::Func || call->call_type == CallType::Image);
}

bool is_sum(const Expr& e) {
  return e.type().is_float() &&
         (e.kind() == Kind::Add || e.kind() == Kind::Sub || as_op(e, Op::lerp));
}

// Whether the sum contains a float product, with which it could be contracted; elements that it reads count as values.
bool may_contract(const Expr& sum) {
  bool product = false;
  walk(sum, [&](const Expr& part) {
    product |= part.type().is_float() &&
               (part.kind() == Kind::Mul || as_op(part, Op::lerp, Op::strong_mul));
    return !product && !reads_element(part);
  });
  return product;
}

bool may_be_negative_as_nan(const Expr& value, Type type) {
  return type.is_int() && is_nonnegative_or_nan(value) &&
         !bounds_of(value, Scope<Interval>()).has_lower_bound();
}

const Cast* as_rounding(const Expr& e) {
  const auto* cast = e.as<Cast>();
  return cast && cast->type.is_int_or_uint() && cast->value.type().is_float() ? cast : nullptr;
}

// Keeps NaN from making a coordinate negative, down to the elements that it reads.
Expr without_nan(const Expr& e, const std::function<Expr(const Expr&)>& recurse) {
  if (reads_element(e)) return e;
  const Cast* cast = as_rounding(e);
  if (!cast || !may_be_negative_as_nan(cast->value, cast->type)) return {};
  return max(map_children(e, recurse), make_zero(cast->type));
}

// The arithmetic of floats alone: equal for expressions that differ in elements, variables, integers and the order of
// operands of sums and products.
Expr arithmetic_of(const Expr& e, const std::function<Expr(const Expr&)>& recurse) {
  if (e.as<Variable>() || reads_element(e)) return variable("", e.type());
  if (const auto* cast = e.as<Cast>(); cast && !cast->value.type().is_float())
    return cast_to(e.type(), variable("", cast->value.type()));
  if (e.kind() != Kind::Add && e.kind() != Kind::Mul) return {};
  const auto& op = static_cast<const Binary&>(*e.get());
  const Expr a = recurse(op.a), b = recurse(op.b);
  return compare(b, a) < 0 ? ir::binary(e.kind(), b, a) : ir::binary(e.kind(), a, b);
}

// The sums that coordinates are rounded from, by their arithmetic.
class RoundedSums {
 public:
  void add_coordinate(const Expr& coordinate) {
    walk(coordinate, [&](const Expr& e) {
      const Cast* cast = as_rounding(e);
      if (cast) add_sums(cast->value);
      return !cast && !reads_element(e);
    });
  }
  // `e` with these sums strict.
  Expr made_strict(const Expr& e) { return sums_.empty() ? e : outside_(e); }

 private:
  std::unordered_set<Expr, StructuralHash, StructuralEqual> sums_;
  StepRewriter arithmetic_{arithmetic_of};
  StepRewriter outside_{[this](const Expr& e, const auto&) {
    return is_sum(e) && sums_.contains(arithmetic_(e))
               ? call_op(Op::strict_float, e.type(), {inside_(e)})
               : Expr();
  }};
  // Elements that a strict sum reads have coordinates of their own.
  StepRewriter inside_{[this](const Expr& e, const auto&) {
    return reads_element(e) ? map_children(e, outside_) : Expr();
  }};

  void add_sums(const Expr& value) {
    walk(value, [&](const Expr& e) {
      if (is_sum(e) && may_contract(e)) sums_.insert(arithmetic_(e));
      return !reads_element(e);
    });
  }
};

// Calls `visit` with each coordinate of elements that the stage reads or writes.
void each_coordinate(const Definition& stage, const std::function<void(const Expr&)>& visit) {
  for (const Expr& arg : stage.args) visit(arg);
  graph::walk_definition(stage, [&](const Expr& e) {
    if (reads_element(e)) std::ranges::for_each(e.as<Call>()->args, visit);
  });
}

}  // namespace

void make_indices_strict(Program& program) {
  StepRewriter coordinate(without_nan);
  StepRewriter coordinates([&](const Expr& e, const auto& recurse) {
    return reads_element(e) ? map_children(map_children(e, recurse), coordinate) : Expr();
  });
  RoundedSums rounded;
  for (LoopedFunc& f : program.funcs) {
    for (Definition& stage : f.stages) {
      each_coordinate(stage, [&](const Expr& e) { rounded.add_coordinate(e); });
      stage = map_exprs(stage, std::ref(coordinates));
      for (Expr& arg : stage.args) arg = coordinate(arg);
    }
  }
  for (LoopedFunc& f : program.funcs) {
    for (Definition& stage : f.stages)
      stage = map_exprs(stage, [&](const Expr& e) { return rounded.made_strict(e); });
  }
}

}  // namespace retrograde::lower
