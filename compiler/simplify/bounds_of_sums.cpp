// Bounds of sums by elimination.
//
// To bound a sum from above, terms are replaced one by one by an upper bound: a variable by its
// upper end, c * (x / c) by x, a minimum by either operand, a maximum or a select by the worse of
// its operands. Cancellation after a replacement makes the bound tight. The number of replacements is limited.
#include <algorithm>
#include <numeric>

#include "ir/build.h"
#include "ir/scalar.h"
#include "simplify/facts.h"

namespace retrograde::simplification {

int64_t Facts::upper_bound(const Sum& sum) {
  Effort effort{32, false};
  return sum.valid ? search(sum, effort) : infinity;
}

int64_t Facts::upper_bound_of_quotients(const Sum& sum) {
  Effort effort{200, true};
  return sum.valid ? search(sum, effort) : infinity;
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

int64_t Facts::search(const Sum& sum, Effort& effort) {
  int64_t best = std::min(bound_by_ranges(sum), known_bound(sum));
  constexpr size_t max_searched_terms = 12;
  if (sum.is_constant() || sum.terms.size() > max_searched_terms || --effort.replacements <= 0)
    return best;
  best = std::min(best, eliminate_structure(sum, effort));
  return std::min(best, eliminate_variable(sum, effort));
}

int64_t Facts::replace(const Sum& sum, const Term& term, const Expr& by, Effort& effort) {
  Sum replaced = sum;
  replaced.add(term.atom, -term.factor);
  replaced.add(sum_of(by), term.factor);
  return replaced.valid ? search(replaced, effort) : infinity;
}

// f * (x / c) with c dividing f: at most (f / c) * x for f > 0, and (f / c) * (x - (c - 1)) for
// f < 0. Where c does not divide f, a multiple of the sum is bounded: n / 2 - (n - 5) / 2 is at most 3, because
// twice of it is at most n - (n - 5 - 1) = 6.
int64_t Facts::eliminate_division(const Sum& sum, const Term& term, const Div& n, Effort& effort) {
  const std::optional<int64_t> divisor = as_const_int(n.b);
  if (!divisor || *divisor <= 1) return infinity;
  const int64_t multiple = *divisor / std::gcd(*divisor, term.factor);
  if (multiple > 1 && !effort.multiplies) return infinity;
  Sum replaced = times(sum, multiple);
  if (!replaced.valid) return infinity;
  const int64_t factor = term.factor * multiple / *divisor;
  replaced.add(term.atom, -term.factor * multiple);
  replaced.add(sum_of(n.a), factor);
  if (const std::optional<int64_t> remainder = congruence(n.a).modulo(*divisor)) {
    replaced.add_constant(saturate(-__int128{factor} * *remainder));
  } else if (factor < 0) {
    replaced.add_constant(saturate(-__int128{factor} * (*divisor - 1)));
  }
  if (!replaced.valid) return infinity;
  const int64_t bound = search(replaced, effort);
  return bound == infinity ? infinity : euclidean_div(bound, multiple);
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
int64_t Facts::eliminate_structure(const Sum& sum, Effort& effort) {
  for (const Term& term : sum.terms) {
    const auto* call = term.atom.as<Call>();
    if (call && call->is_likely()) return replace(sum, term, call->args[0], effort);
  }
  for (const bool either : {false, true}) {
    for (const Term& term : sum.terms) {
      const std::optional<Choice> choice = choice_of(term);
      if (!choice || choice->either != either) continue;
      const int64_t a = replace(sum, term, choice->a, effort),
                    b = replace(sum, term, choice->b, effort);
      return either ? std::min(a, b) : std::max(a, b);
    }
  }
  for (const Term& term : sum.terms) {  // last, because the terms inside the others may cancel it
    const auto* n = term.atom.as<Div>();
    const int64_t bound = n ? eliminate_division(sum, term, *n, effort) : infinity;
    if (bound != infinity) return bound;
  }
  return infinity;
}

// Replaces the innermost variable whose relevant end is an expression.
int64_t Facts::eliminate_variable(const Sum& sum, Effort& effort) {
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
  return replace(sum, *innermost, innermost->factor > 0 ? bounds->max : bounds->min, effort);
}

}  // namespace retrograde::simplification
