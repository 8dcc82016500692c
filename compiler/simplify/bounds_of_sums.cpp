// Bounds of sums by elimination.
//
// To bound a sum from above, terms are replaced one by one by an upper bound: a variable by its
// upper end, c * (x / c) by x, a minimum by either operand, a maximum or a select by the worse of
// its operands. Cancellation after a replacement makes the bound tight. Each replacement costs one
// unit of a fixed budget.
#include <algorithm>

#include "ir/build.h"
#include "simplify/facts.h"

namespace retrograde::simplification {

int64_t Facts::upper_bound(const Sum& sum) {
  int budget = 32;
  return sum.valid ? search(sum, budget) : infinity;
}

int64_t Facts::lower_bound(const Sum& sum) {
  const int64_t upper = upper_bound(times(sum, -1));
  return upper == infinity ? INT64_MIN : -upper;
}

int64_t Facts::bound_by_ranges(const Sum& sum) {
  int64_t result = sum.constant;
  for (const Term& term : sum.terms) {
    const int64_t end = (range(term.atom) * term.factor).max;
    // The ends of the type do not bound a difference: x - y of two int32 may have any value.
    if (end == infinity) return infinity;
    result = add_ends(result, end);
  }
  return result;
}

int64_t Facts::search(const Sum& sum, int& budget) {
  int64_t best = std::min(bound_by_ranges(sum), known_bound(sum));
  constexpr size_t max_searched_terms = 12;
  if (sum.is_constant() || sum.terms.size() > max_searched_terms || --budget <= 0) return best;
  best = std::min(best, eliminate_structure(sum, budget));
  return std::min(best, eliminate_variable(sum, budget));
}

int64_t Facts::replace(const Sum& sum, const Term& term, const Expr& by, int& budget) {
  Sum replaced = sum;
  replaced.add(term.atom, -term.factor);
  replaced.add(sum_of(by), term.factor);
  return replaced.valid ? search(replaced, budget) : infinity;
}

// f * (x / c) with c dividing f: at most (f / c) * x for f > 0, and (f / c) * (x - (c - 1)) for
// f < 0.
int64_t Facts::eliminate_division(const Sum& sum, const Term& term, const Div& n, int& budget) {
  const std::optional<int64_t> divisor = as_const_int(n.b);
  if (!divisor || *divisor <= 1 || term.factor % *divisor != 0) return infinity;
  const int64_t factor = term.factor / *divisor;
  Sum replaced = sum;
  replaced.add(term.atom, -term.factor);
  replaced.add(sum_of(n.a), factor);
  if (const std::optional<int64_t> remainder = congruence(n.a).modulo(*divisor)) {
    replaced.add_constant(saturate(-__int128{factor} * *remainder));
  } else if (factor < 0) {
    replaced.add_constant(saturate(-__int128{factor} * (*divisor - 1)));
  }
  return replaced.valid ? search(replaced, budget) : infinity;
}

namespace {

// A term that is one of two values. Either value bounds it (`either`), or only both together.
struct Choice {
  Expr a, b;
  bool either;
};
std::optional<Choice> choice_of(const Term& term) {
  const Kind kind = term.atom.kind();
  if (kind == Kind::Min || kind == Kind::Max) {
    const auto* n = term.atom.as<Binary>();
    return Choice{n->a, n->b, (kind == Kind::Min) == (term.factor > 0)};
  }
  if (const auto* n = term.atom.as<Select>()) return Choice{n->when_true, n->when_false, false};
  const auto* call = term.atom.as<Call>();
  if (!call || !call->is_op(Op::promise_clamped, Op::unsafe_promise_clamped)) return std::nullopt;
  return Choice{call->args[0], call->args[term.factor > 0 ? 2 : 1], true};
}

}  // namespace

// Replaces the first term that can be looked through or that is a choice of two values. Choices
// that need both values lose nothing, so they come first. For example, max(e, 0) - max(e + 1, 0) is
// at most 0: both e - max(e + 1, 0) and 0 - max(e + 1, 0) are, by different values of the second
// maximum.
int64_t Facts::eliminate_structure(const Sum& sum, int& budget) {
  for (const Term& term : sum.terms) {
    const auto* call = term.atom.as<Call>();
    if (call && call->is_likely()) return replace(sum, term, call->args[0], budget);
  }
  for (const bool either : {false, true}) {
    for (const Term& term : sum.terms) {
      const std::optional<Choice> choice = choice_of(term);
      if (!choice || choice->either != either) continue;
      const int64_t a = replace(sum, term, choice->a, budget),
                    b = replace(sum, term, choice->b, budget);
      return either ? std::min(a, b) : std::max(a, b);
    }
  }
  for (const Term& term : sum.terms) {  // last, because the terms inside the others may cancel it
    const auto* n = term.atom.as<Div>();
    const int64_t bound = n ? eliminate_division(sum, term, *n, budget) : infinity;
    if (bound != infinity) return bound;
  }
  return infinity;
}

// Replaces the innermost variable whose relevant end is an expression.
int64_t Facts::eliminate_variable(const Sum& sum, int& budget) {
  const Term* innermost = nullptr;
  const Bounds* bounds = nullptr;
  for (const Term& term : sum.terms) {
    const auto* n = term.atom.as<Variable>();
    const auto found = n ? variables_.find(n->name) : variables_.end();
    if (found == variables_.end() || (bounds && found->second.order < bounds->order)) continue;
    const Expr& end = term.factor > 0 ? found->second.max : found->second.min;
    if (!end.defined() || is_const(end) || end.type() != n->type) continue;
    innermost = &term;
    bounds = &found->second;
  }
  if (!innermost) return infinity;
  return replace(sum, *innermost, innermost->factor > 0 ? bounds->max : bounds->min, budget);
}

}  // namespace retrograde::simplification
