#include "porting/interval.h"

#include "analysis/interval.h"
#include "porting/expressions.h"
#include "simplify/simplify.h"

namespace retrograde::porting {

// No program uses these names. Each end is a single node, because ends are compared by identity.
Expr Interval::pos_inf() {
  static const Expr end = ir::variable("pos_inf", Handle());
  return end;
}
Expr Interval::neg_inf() {
  static const Expr end = ir::variable("neg_inf", Handle());
  return end;
}

bool Interval::can_prove_is_single_point() const {
  return is_single_point() || (is_bounded() && porting::can_prove(min == max));
}

bool Interval::operator==(const Interval& other) const {
  return equal(min, other.min) && equal(max, other.max);
}

Expr Interval::make_max(const Expr& a, const Expr& b) {
  if (a.same_as(pos_inf()) || b.same_as(neg_inf()) || equal(a, b)) return a;
  if (b.same_as(pos_inf()) || a.same_as(neg_inf())) return b;
  return porting::simplify(retrograde::max(a, b));
}
Expr Interval::make_min(const Expr& a, const Expr& b) {
  if (a.same_as(neg_inf()) || b.same_as(pos_inf()) || equal(a, b)) return a;
  if (b.same_as(neg_inf()) || a.same_as(pos_inf())) return b;
  return porting::simplify(retrograde::min(a, b));
}
Interval Interval::make_union(const Interval& a, const Interval& b) {
  return {make_min(a.min, b.min), make_max(a.max, b.max)};
}
Interval Interval::make_intersection(const Interval& a, const Interval& b) {
  return {make_max(a.min, b.min), make_min(a.max, b.max)};
}

namespace {

ir::Interval without_infinities(const Interval& interval) {
  ir::Interval result;
  if (interval.has_lower_bound()) result.min = interval.min;
  if (interval.has_upper_bound()) result.max = interval.max;
  return result;
}

simplification::BoundsMap bounds_of(const Scope<Interval>& scope) {
  simplification::BoundsMap bounds;
  scope.for_each([&](const std::string& name, const Interval& interval) {
    bounds[name] = without_infinities(interval);
  });
  return bounds;
}

}  // namespace

Interval bounds_of_expr_in_scope(const Expr& e, const Scope<Interval>& scope,
                                 bool constant_bounds) {
  analysis::Scope<ir::Interval> variables;
  scope.for_each([&](const std::string& name, const Interval& interval) {
    variables.push(name, without_infinities(interval));
  });
  const ir::Interval found = analysis::bounds_of(e, variables);
  const auto end = [&](const Expr& bound, const Expr& infinity) {
    if (!bound.defined()) return infinity;
    const Expr simple = porting::simplify(bound);
    return constant_bounds && !ir::is_const(simple) ? infinity : simple;
  };
  return {end(found.min, Interval::neg_inf()), end(found.max, Interval::pos_inf())};
}

Expr simplify(const Expr& e, const Scope<Interval>& bounds) {
  return e.defined() ? simplification::simplify(e, bounds_of(bounds)) : e;
}
bool can_prove(const Expr& condition, const Scope<Interval>& bounds) {
  return simplification::can_prove(condition, bounds_of(bounds));
}

}  // namespace retrograde::porting
