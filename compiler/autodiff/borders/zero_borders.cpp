#include "autodiff/borders/zero_borders.h"

#include <algorithm>

#include "autodiff/borders/border_conditions.h"
#include "autodiff/rules/derivative_rules.h"
#include "graph/function.h"
#include "ir/build.h"
#include "ir/equal.h"
#include "ir/markers.h"
#include "ir/visit.h"
#include "simplify/simplify.h"

namespace retrograde::autodiff {

namespace {

// An expression that is at least 0 where an integer comparison holds; undefined for other conditions.
Expr slack(const Expr& condition) {
  const auto is_whole = [](const Expr& e) { return e.type() == Int(32); };
  if (const auto* n = condition.as<LT>(); n && is_whole(n->a)) return n->b - n->a - 1;
  if (const auto* n = condition.as<LE>(); n && is_whole(n->a)) return n->b - n->a;
  if (const auto* n = condition.as<GT>(); n && is_whole(n->a)) return n->a - n->b - 1;
  if (const auto* n = condition.as<GE>(); n && is_whole(n->a)) return n->a - n->b;
  return {};
}
bool implies(const Expr& a, const Expr& b) {
  const Expr of_a = slack(a), of_b = slack(b);
  return of_a.defined() && of_b.defined() && can_prove(of_b >= of_a);
}

// An index without the clamps into a domain that access_inversion.h added.
Expr before_clamps(const Expr& index) {
  const auto is_place = [](const Expr& e) {
    return any_node(e, [](const Call& call) { return call.is_likely(); });
  };
  const auto inner = [&](const Expr& a, const Expr& b) {
    return is_place(a) != is_place(b) ? before_clamps(is_place(a) ? a : b) : index;
  };
  if (const auto* n = index.as<Min>()) return inner(n->a, n->b);
  if (const auto* n = index.as<Max>()) return inner(n->a, n->b);
  return as_op(index, Op::likely) ? without_likely(index) : index;
}

// A place that was clamped into a domain, beyond which the term is zero now.
struct DroppedClamp {
  Expr clamped, place;
};

// Replaces clamped places where that moves no read, because the term is zero where they differ: in numerators of
// remainders, and in what is not part of an index. Then all lanes of a vector have the same remainder, also at a border.
Expr with_places_in_remainders(const Expr& e, const DroppedClamp& dropped);
Expr with_places(const Expr& e, const DroppedClamp& dropped) {
  return rewrite(e, [&](const Expr& node, const auto&) -> Expr {
    if (equal(node, dropped.clamped)) return dropped.place;
    const auto* call = node.as<Call>();
    const bool may_read =
        call && (call->call_type != CallType::Operator || call->is_op(Op::if_then_else));
    return may_read ? with_places_in_remainders(node, dropped) : Expr();
  });
}
Expr with_places_in_remainders(const Expr& e, const DroppedClamp& dropped) {
  return rewrite(e, [&](const Expr& node, const auto&) -> Expr {
    const auto* n = node.as<Mod>();
    const bool has_period = n && as_const_int(n->b).value_or(0) > 0;
    return has_period ? with_places(n->a, dropped) % n->b : Expr();
  });
}

// Returns the call without the clamp of its index, if the callee is an adjoint that is zero where the condition is
// false; else an undefined Expr. Notes the clamp.
Expr unclamped_read(const Expr& e, const Expr& condition, std::vector<DroppedClamp>& dropped) {
  const auto* call = e.as<Call>();
  const FuncPtr f = call && call->call_type == CallType::Func ? func_of(*call) : nullptr;
  if (!f || !f->made || !f->is_pure() || f->is_extern() || f->pure->values.size() != 1) return {};
  const auto* choice = f->pure->values[0].as<Select>();
  if (!choice || !is_zero(choice->when_false)) return {};
  std::vector<Expr> conditions;
  add_conjuncts(without_likely(choice->condition), conditions);
  for (size_t d = 0; d < f->args.size(); ++d) {
    const Expr place = before_clamps(call->args[d]);
    for (const Expr& inside : conditions) {
      if (!uses_variable(inside, f->args[d])) continue;
      const Expr here = substitute(inside, {{f->args[d], place}});
      if (!implies(here, condition)) continue;
      std::vector<Expr> args = call->args;
      if (!place.same_as(args[d])) dropped.push_back({args[d], place});
      args[d] = place;
      return call_func(call->name, call->type, args, call->component, call->symbol);
    }
  }
  return {};
}

// The term where the condition holds, and zero elsewhere; undefined if it cannot be written without the condition.
Expr zero_without(const Expr& term, const Expr& condition, std::vector<DroppedClamp>& dropped) {
  const auto in = [&](const Expr& e) { return zero_without(e, condition, dropped); };
  const auto both = [&](const Expr& a, const Expr& b, auto make) -> Expr {
    const Expr first = is_zero(a) ? a : in(a);
    const Expr second = !first.defined() || is_zero(b) ? b : in(b);
    return first.defined() && second.defined() ? make(first, second) : Expr();
  };
  if (const Call* product = as_op(term, Op::strong_mul)) {
    const Expr a = in(product->args[0]);
    return a.defined() ? call_op(Op::strong_mul, term.type(), {a, product->args[1]}) : Expr();
  }
  if (const auto* n = term.as<Mul>()) {
    if (!is_finite_constant(n->b)) return {};
    const Expr a = in(n->a);
    return a.defined() ? a * n->b : Expr();
  }
  if (const auto* n = term.as<Add>())
    return both(n->a, n->b, [](const Expr& a, const Expr& b) { return a + b; });
  if (const auto* n = term.as<Sub>())
    return both(n->a, n->b, [](const Expr& a, const Expr& b) { return a - b; });
  if (const auto* n = term.as<Select>()) {
    return both(n->when_true, n->when_false,
                [&](const Expr& a, const Expr& b) { return make_select(n->condition, a, b); });
  }
  return unclamped_read(term, condition, dropped);
}

// Intervals of variables between constants, by comparisons with these.
void add_range(simplification::BoundsMap& bounds, const Expr& condition) {
  const auto limit = [&](const Expr& variable, const Expr& end, int64_t distance, bool is_low) {
    const auto* v = variable.as<Variable>();
    const auto value = as_const_int(end);
    if (!v || !value || variable.type() != Int(32)) return;
    Interval& range = bounds[v->name];
    (is_low ? range.min : range.max) = make_const(Int(32), *value + distance);
  };
  if (const auto* n = condition.as<LT>()) {
    limit(n->b, n->a, 1, true);
    limit(n->a, n->b, -1, false);
  } else if (const auto* m = condition.as<LE>()) {
    limit(m->b, m->a, 0, true);
    limit(m->a, m->b, 0, false);
  }
}

// The term with unclamped places, in which conditions and remainders are as simple as they were in the primal.
// Conditions may use where the gather runs; indices may not, since bounds inference does not see its predicate.
Expr without_clamps(const Expr& term, const std::vector<DroppedClamp>& dropped, const Gather& g) {
  Expr result = term;
  for (const DroppedClamp& clamp : dropped) result = with_places(result, clamp);
  if (result.same_as(term)) return term;
  simplification::BoundsMap loops;
  for (const ReductionVariable& r : g.rdom->vars)
    loops[r.var] = {r.min, simplify(r.min + r.extent - 1)};
  simplification::BoundsMap all = loops;
  std::vector<Expr> conditions;
  add_conjuncts(without_likely(g.predicate), conditions);
  for (const Expr& condition : conditions) add_range(all, condition);
  result = rewrite(result, [&](const Expr& node, const auto& recurse) -> Expr {
    const auto* n = node.as<Select>();
    return n ? make_select(simplify(n->condition, all), recurse(n->when_true),
                           recurse(n->when_false))
             : Expr();
  });
  return simplify(result, loops);
}

// Whether the condition belongs to a border between taps that is thin compared with the target's extent. If there are
// many taps for the elements, the condition leaves out much work and stays. A condition on parameters alone may fail
// arbitrarily far beyond a border, and the zeros up to there would be stored.
constexpr double least_of_a_tap = 4;
bool is_thin(const Expr& condition, const Gather& g, const AdjointTarget& target) {
  const auto is_of = [&](const std::string& arg) { return uses_variable(condition, arg); };
  if (std::ranges::none_of(target.args, is_of)) return false;
  double taps = 1;
  for (const ReductionVariable& r : g.rdom->vars) {
    if (uses_variable(condition, r.var))
      taps *= static_cast<double>(as_const_int(r.extent).value_or(1));
  }
  if (taps == 1) return false;  // depends on the element only, not on the tap
  for (size_t d = 0; d < target.region.size() && d < target.args.size(); ++d) {
    if (!uses_variable(condition, target.args[d])) continue;
    const auto extent = constant_extent(target.region[d].range());
    if (extent && static_cast<double>(*extent) < least_of_a_tap * taps) return false;
  }
  return true;
}

}  // namespace

void leave_zeros_to_adjoints(std::vector<Contribution>& contributions,
                             const AdjointTarget& target) {
  for (Contribution& c : contributions) {
    const Gather& g = c.gather;
    if (!g.rdom || g.scatters || !g.predicate.defined()) continue;
    std::vector<Expr> conditions, kept;
    std::vector<DroppedClamp> all_dropped;
    add_conjuncts(g.predicate, conditions);
    for (const Expr& condition : conditions) {
      const bool may_go =
          fails_in_a_border(condition, g.rdom->vars) && is_thin(condition, g, target);
      std::vector<DroppedClamp> dropped;
      const Expr term =
          may_go ? zero_without(c.adjoint, without_likely(condition), dropped) : Expr();
      if (!term.defined()) {
        kept.push_back(condition);
        continue;
      }
      c.adjoint = term;
      append(all_dropped, dropped);
    }
    c.adjoint = without_clamps(c.adjoint, all_dropped, g);
    if (kept.size() < conditions.size())
      c.gather.predicate = kept.empty() ? Expr() : conjunction(kept);
  }
}

}  // namespace retrograde::autodiff
