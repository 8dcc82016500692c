#include "lower/loops/bounded_extents.h"

#include <algorithm>

#include "ir/build.h"
#include "ir/equal.h"
#include "ir/markers.h"
#include "lower/expand_lets_in_scope.h"
#include "simplify/constant_range.h"
#include "simplify/simplify.h"

namespace retrograde::lower {

namespace {

constexpr int most_choices = 6;  // selects in one extent whose arms are bounded separately

Expr find_select(const Expr& e) {
  Expr found;
  walk(e, [&](const Expr& part) {
    if (!found.defined() && part.as<Select>()) found = part;
    return !found.defined();
  });
  return found;
}

// The expression with every select on this condition with_decided_selects.
Expr with_decided_selects(const Expr& e, const Expr& condition, bool value) {
  return simplify(rewrite(e, [&](const Expr& part, const auto& recurse) -> Expr {
    const Select* choice = part.as<Select>();
    if (!choice || !equal(choice->condition, condition)) return {};
    return recurse(value ? choice->when_true : choice->when_false);
  }));
}

// An upper bound of an extent, or of a size: sums and products of extents that are converted to 64 bits.
int64_t bound_without_choices(const Expr& e, Facts& facts) {
  const int64_t bound = facts.range(e).max;
  const auto bound_of_part = [&](const Expr& part) { return bound_without_choices(part, facts); };
  const auto* cast = e.as<Cast>();
  if (cast && cast->value.type() == Int(32) && e.type() == Int(64))
    return std::min(bound, bound_of_part(cast->value));
  const auto* n = e.type() == Int(64) ? e.as<Binary>() : nullptr;
  if (n && n->kind == Kind::Add)
    return std::min(bound, add_ends(bound_of_part(n->a), bound_of_part(n->b)));
  if (n && n->kind == Kind::Mul && facts.range(n->a).min >= 0 && facts.range(n->b).min >= 0)
    return std::min(bound, saturate(__int128{bound_of_part(n->a)} * bound_of_part(n->b)));
  if (is_const(e) || !is_index_type(e.type())) return bound;
  return std::min(bound, facts.upper_bound_of_quotients(sum_of(e)));
}

int64_t bound_of(const Expr& e, Facts& facts, int choices) {
  const Expr choice = choices > 0 ? find_select(e) : Expr();
  if (!choice.defined()) return bound_without_choices(e, facts);
  const Expr condition = choice.as<Select>()->condition;
  const auto arm = [&](bool value) {
    const Facts::Assumption holds(facts, simplify(value ? condition : logical_not(condition)));
    facts.forget();
    return bound_of(with_decided_selects(e, condition, value), facts, choices - 1);
  };
  const int64_t most = std::max(arm(true), arm(false));
  facts.forget();
  return most;
}

// Pairs of an expression and the constant that a condition says it equals, as n == 3.
using Constants = std::vector<std::pair<Expr, Expr>>;
void add_constants(const Expr& condition, Constants& constants) {
  std::vector<Expr> conjuncts;
  add_conjuncts(condition, conjuncts);
  for (const Expr& e : conjuncts) {
    const EQ* same = e.as<EQ>();
    if (!same || is_const(same->a) == is_const(same->b)) continue;
    if (is_const(same->b))
      constants.emplace_back(same->a, same->b);
    else
      constants.emplace_back(same->b, same->a);
  }
}

Expr with_constants(const Expr& e, const Constants& constants) {
  if (constants.empty()) return e;
  return rewrite(e, [&](const Expr& part, const auto&) -> Expr {
    for (const auto& [name, value] : constants) {
      if (equal(part, name)) return value;
    }
    return {};
  });
}

}  // namespace

Stmt BoundedExtents::parts(const Stmt& s) {
  if (const IfThenElse* choice = s.as<IfThenElse>()) return chosen(*choice);
  if (const LetStmt* let = s.as<LetStmt>()) values_[let->name] = let->value;
  const For* loop = s.as<For>();
  if (!loop) return children(s);
  loops_.push_back(loop);
  Stmt result = children(s);
  loops_.pop_back();
  return result;
}

Stmt BoundedExtents::chosen(const IfThenElse& choice) {
  const auto under = [&](const Expr& condition, const Stmt& branch) {
    if (!branch.defined()) return branch;
    conditions_.push_back(condition);
    Stmt result = (*this)(branch);
    conditions_.pop_back();
    return result;
  };
  const Stmt when_true = under(choice.condition, choice.when_true);
  return with_parts(choice, choice.condition, when_true,
                    under(logical_not(choice.condition), choice.when_false));
}

bool BoundedExtents::mentions_few_names(const Expr& extent, int names) const {
  return count_names(extent, names);
}

// Subtracts the number of names in `e` from `left`; false once it is negative.
bool BoundedExtents::count_names(const Expr& e, int& left) const {
  walk(e, [&](const Expr& part) {
    const auto* name = part.as<Variable>();
    if (!name) return left >= 0;
    const auto value = values_.find(name->name);
    if (--left >= 0 && value != values_.end()) count_names(value->second, left);
    return false;
  });
  return left >= 0;
}

std::optional<int64_t> BoundedExtents::largest(const Expr& extent, int64_t most) const {
  const auto full = [&](const Expr& e) {
    return simplify(without_likely(expand_lets_in_scope(e, values_)));
  };
  Facts facts;
  for (const For* loop : loops_) {
    const Expr min = full(loop->min);
    facts.bind(loop->name, min, simplify(min + full(loop->extent) - 1));
  }
  Constants constants;
  for (const Expr& condition : conditions_) {
    const Expr holds = full(condition);
    facts.assume(holds);
    add_constants(holds, constants);
  }
  const Expr value = simplify(with_constants(full(extent), constants));
  const int64_t bound = bound_of(value, facts, most_choices);
  return bound <= most ? std::optional(std::max<int64_t>(bound, 0)) : std::nullopt;
}

}  // namespace retrograde::lower
