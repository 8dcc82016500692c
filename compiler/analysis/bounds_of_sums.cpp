// Bounds of integer sums. A sum is bounded in linear form, so that a variable that occurs twice counts once. Terms that
// depend on each other are joined first; then facts, minima and maxima are used before the terms are bounded one by one.
#include <algorithm>

#include "analysis/bounds_engine.h"
#include "analysis/interval_arithmetic.h"
#include "ir/build.h"
#include "ir/join_clamps.h"

namespace retrograde::analysis {

Interval BoundsEngine::sum_bounds(const Sum& form) {
  if (!form.valid) return Interval::everything();
  const std::optional<Interval> known = bounds_by_facts(form);
  if (known) return *known;
  const std::optional<Interval> apart = bounds_by_distribution(form);
  return apart ? *apart : sum_of_bounds(form);
}

// Collects the varying atoms of a sum with their signs. It looks into both sides of minima and
// maxima, and into dividends, of which a remainder may be left. Nested minima repeat their sides,
// so the number is limited.
void BoundsEngine::collect_varying(const Sum& form, bool negated,
                                   std::vector<std::pair<Expr, bool>>& found) {
  for (const Term& term : form.terms) {
    const Expr& atom = term.atom;
    if (found.size() >= most_varying || !varies(atom)) continue;
    const bool negative = (term.factor < 0) != negated;
    if (atom.kind() == Kind::Min || atom.kind() == Kind::Max) {
      const auto& op = *atom.as<Binary>();
      collect_varying(linear_form(op.a), negative, found);
      collect_varying(linear_form(op.b), negative, found);
    } else if (const Div* div = atom.as<Div>(); div && as_const_int(div->b).value_or(0) > 0) {
      collect_varying(linear_form(div->a), negative, found);
    } else {
      found.emplace_back(atom, negative);
    }
  }
}

// Whether both contain a varying atom that partly cancels in their sum.
bool BoundsEngine::may_cancel(const Sum& rest, const Sum& side, int64_t factor) {
  std::vector<std::pair<Expr, bool>> of_rest, of_side;
  collect_varying(side, factor < 0, of_side);
  if (of_side.empty()) return false;
  collect_varying(rest, false, of_rest);
  return std::ranges::any_of(of_side, [&](const auto& part) {
    return std::ranges::any_of(of_rest, [&](const auto& other) {
      return other.second != part.second && other.first.same_as(part.first);
    });
  });
}

// 16*x + 8*min(d - 2*x, 1)  is  min(8*d, 16*x + 8): bounding x and the minimum separately would be
// too wide. The same holds for max. Each step removes one minimum or maximum, and doubles the work,
// so the number of steps is limited.
std::optional<Interval> BoundsEngine::bounds_by_distribution(const Sum& form) {
  for (const Term& term : form.terms) {
    const Expr& atom = term.atom;
    if (atom.kind() != Kind::Min && atom.kind() != Kind::Max) continue;
    const auto& op = *atom.as<Binary>();
    const Sum rest = plus(form, linear_form(atom), -term.factor);
    const Sum a = linear_form(op.a), b = linear_form(op.b);
    if (!rest.valid || !a.valid || !b.valid || distributions_ >= most_distributions) continue;
    if (!may_cancel(rest, a, term.factor) && !may_cancel(rest, b, term.factor)) continue;
    ++distributions_;
    const Interval x = sum_bounds(join_correlated_terms(plus(rest, a, term.factor)));
    const Interval y = sum_bounds(join_correlated_terms(plus(rest, b, term.factor)));
    --distributions_;
    const bool is_least = (atom.kind() == Kind::Min) == (term.factor > 0);
    return is_least ? interval_min(x, y) : interval_max(x, y);
  }
  return std::nullopt;
}

// If x + y <= 29 is known, x + y + z is at most 29 + z. The separate ends of x and y, 29 - y and 29
// - x, would give a wider range once the loops over x and y are eliminated.
std::optional<Interval> BoundsEngine::bounds_by_facts(const Sum& form) {
  std::optional<Interval> result;
  for (const Sum& fact : facts_) {
    if (!(fact.type == form.type)) continue;
    const Sum below = plus(form, fact, -1), above = plus(form, fact);  // form <= below
    const size_t left = form.terms.size() - std::min(form.terms.size(), fact.terms.size());
    const bool is_below = below.terms.size() == left, is_above = above.terms.size() == left;
    if (form.terms.size() < fact.terms.size() || (!is_below && !is_above)) continue;
    if (!result) result = outer_->sum_bounds(form);
    Interval implied;
    if (is_below) implied.max = outer_->sum_bounds(below).max;
    if (is_above) implied.min = outer_->sum_bounds(above).min;
    result = intersection(*result, implied);
  }
  return result;
}

// Adds the ends term by term; the part that does not vary is added to both.
Interval BoundsEngine::sum_of_bounds(const Sum& form) {
  Sum fixed = linear_sum(form.type, form.constant);
  std::vector<std::pair<Interval, int64_t>> varying;
  for (const Term& term : form.terms) {
    if (varies(term.atom)) {
      varying.emplace_back(bounds_of_atom(term.atom), term.factor);
    } else {
      fixed = plus(fixed, linear_form(term.atom), term.factor);
    }
  }
  auto end = [&](bool upper) -> Expr {
    Sum sum = fixed;
    for (const auto& [interval, coefficient] : varying) {
      const Expr& part = upper == (coefficient > 0) ? interval.max : interval.min;
      if (!part.defined()) return {};
      sum = plus(sum, linear_form(part), coefficient);
    }
    return to_expr(sum);
  };
  Interval result{end(false), end(true)};
  // Equal ends share one handle, so that is_point() holds.
  if (result.is_bounded() && constant_difference(result.min, result.max) == 0)
    result.max = result.min;
  return result;
}

namespace {

Expr canonical_cut(Kind kind, const Expr& a, const Expr& b) {
  return kind == Kind::Min ? canonical_min(a, b) : canonical_max(a, b);
}

}  // namespace

// Joins correlated terms. c*y - c*k*(y / k)  is  c*(y % k). The same holds for a varying part of y:
// a + k*((b - a) / k), the start of the last tile, is  b - (b - a) % k  for any a. The difference
// of two clamps of one value becomes one clamp.
Sum BoundsEngine::join_correlated_terms(Sum form) {
  for (const Term& term : std::vector<Term>(form.terms)) {
    const Div* div = term.atom.as<Div>();
    auto k = div ? as_const_int(div->b) : std::nullopt;
    if (!k || *k <= 0 || term.factor % *k != 0) continue;
    int64_t c = -term.factor / *k;
    Sum y = linear_form(div->a);
    bool contains_all = !y.terms.empty(), contains_varying = false;
    for (const Term& part : y.terms) {
      const bool found = std::ranges::any_of(form.terms, [&](const Term& t) {
        return t.atom.same_as(part.atom) && t.factor == __int128{c} * part.factor;
      });
      contains_all &= found;
      contains_varying |= found && varies(part.atom);
    }
    if (!contains_all && !contains_varying) continue;
    form = plus(form, y, -c);
    form = plus(form, linear_form(term.atom), -term.factor);
    form = plus(form, linear_form(binary(Kind::Mod, div->a, div->b)), c);
  }
  while (join_clamps(form, canonical_cut)) {
  }
  return form;
}

}  // namespace retrograde::analysis
