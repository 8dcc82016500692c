#include "autodiff/inversion/split_at_select.h"

#include "autodiff/inversion/isl_bridge.h"
#include "ir/build.h"
#include "simplify/simplify.h"

namespace retrograde::autodiff {

namespace {

Expr negation(const Expr& e) {
  if (const auto* n = e.as<Or>()) return negation(n->a) && negation(n->b);
  if (const auto* n = e.as<And>()) return negation(n->a) || negation(n->b);
  if (const auto* n = e.as<Not>()) return n->a;
  const auto* b = e.as<Binary>();
  if (!b || b->a.type().is_float()) return logical_not(e);
  switch (b->kind) {
    case Kind::LT:
      return b->a >= b->b;
    case Kind::LE:
      return b->a > b->b;
    case Kind::GT:
      return b->a <= b->b;
    case Kind::GE:
      return b->a < b->b;
    default:
      return logical_not(e);
  }
}

// Tightens the bounds of variables by conjuncts like x < 5, so that reduction domains are short.
void tighten(IterationDomain& domain, const Expr& conjunct) {
  if (const auto* both = conjunct.as<And>()) {
    tighten(domain, both->a);
    tighten(domain, both->b);
    return;
  }
  const auto* c = conjunct.as<Binary>();
  if (!c || c->kind < Kind::LT || c->kind > Kind::GE || !c->a.type().is_int()) return;
  bool less = c->kind == Kind::LT || c->kind == Kind::LE,
       strict = c->kind == Kind::LT || c->kind == Kind::GT;
  auto apply = [&](const Expr& name, Expr bound, bool upper) {
    const auto* v = name.as<Variable>();
    for (const LoopVariable& other : domain.vars) {
      if (uses_variable(bound, other.name)) return;
    }
    for (LoopVariable& mine : domain.vars) {
      if (!v || mine.name != v->name || !mine.min.defined() || !mine.max.defined()) continue;
      if (strict) bound = upper ? bound - 1 : bound + 1;
      (upper ? mine.max : mine.min) = simplify(upper ? min(mine.max, bound) : max(mine.min, bound));
    }
  };
  apply(c->a, c->b, less);
  apply(c->b, c->a, !less);
}

AccessQuery restricted(AccessQuery query, size_t d, const Expr& index, const Expr& condition) {
  Expr& predicate = query.domain.predicate;
  predicate = predicate.defined() ? predicate && condition : condition;
  query.indices[d] = index;
  return query;
}

}  // namespace

std::vector<AccessQuery> split_at_select(const AccessQuery& query) {
  IslContext context;
  IslBridge bridge(context, names_of(query.domain.vars));
  for (size_t d = 0; d < query.indices.size(); ++d) {
    const auto* s = query.indices[d].as<Select>();
    if (!s || bridge.affine(query.indices[d]) || !bridge.condition(s->condition)) continue;
    if (!bridge.affine(s->when_true) && !bridge.affine(s->when_false)) continue;
    std::vector<AccessQuery> parts{restricted(query, d, s->when_false, negation(s->condition))};
    // A disjunction is split into disjoint parts, whose domains are boxes again.
    Expr before = const_true(), rest = s->condition;
    for (const auto* either = rest.as<Or>(); either; either = rest.as<Or>()) {
      parts.push_back(restricted(query, d, s->when_true, before && either->a));
      before = before && negation(either->a);
      rest = either->b;
    }
    parts.push_back(restricted(query, d, s->when_true, before && rest));
    for (AccessQuery& part : parts) tighten(part.domain, part.domain.predicate);
    return parts;
  }
  return {};
}

}  // namespace retrograde::autodiff
