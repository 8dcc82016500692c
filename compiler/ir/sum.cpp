// Gathers expressions into sums and rebuilds expressions from them.
#include "ir/sum.h"

#include <algorithm>
#include <numeric>

#include "ir/build.h"
#include "ir/equal.h"
#include "ir/scalar.h"

namespace retrograde::ir {

namespace {

// Adds factor * e to the sum; fails when that takes too many steps or terms.
class Gatherer {
 public:
  explicit Gatherer(Sum& sum) : sum_(sum) {}

  bool gather(const Expr& e, int64_t factor) {
    if (++steps_ > 3 * max_terms) return false;
    if (const std::optional<int64_t> value = as_const_int(e)) {
      sum_.add_constant(__int128{*value} * factor);
      return true;
    }
    if (const auto* add = e.as<Add>()) return gather(add->a, factor) && gather(add->b, factor);
    if (const auto* sub = e.as<Sub>(); sub && factor != INT64_MIN) {
      return gather(sub->a, factor) && gather(sub->b, -factor);
    }
    if (const auto* mul = e.as<Mul>()) {
      if (const std::optional<int64_t> value = as_const_int(mul->b)) {
        const __int128 product = __int128{*value} * factor;
        if (product == static_cast<int64_t>(product))
          return gather(mul->a, static_cast<int64_t>(product));
      }
    }
    sum_.add(e, factor);
    return sum_.terms.size() <= max_terms;
  }

 private:
  Sum& sum_;
  size_t steps_ = 0;
};

}  // namespace

// Structural order would read better, but may have to look at both trees entirely.
bool canonical_less(const Expr& a, const Expr& b) {
  if (a->kind != b->kind) return a->kind < b->kind;
  if (const auto* x = a.as<Variable>()) return x->name < b.as<Variable>()->name;
  const size_t x = hash(a), y = hash(b);
  return x != y ? x < y : compare(a, b) < 0;
}

bool is_extreme(Type type, int64_t value) {
  const int64_t limit = type.max_int() / 2;
  return value > limit || value < -limit;
}

bool may_be_extreme(const Expr& e, int depth) {
  const std::optional<int64_t> value = as_const_int(e);
  if (value) return is_extreme(e.type(), *value);
  if (depth == 0) return false;
  if (const auto* n = e.as<Select>()) {
    return may_be_extreme(n->when_true, depth - 1) || may_be_extreme(n->when_false, depth - 1);
  }
  const Kind kind = e.kind();
  const bool looks_through = kind == Kind::Min || kind == Kind::Max || kind == Kind::Add ||
                             kind == Kind::Sub || kind == Kind::Mul;
  if (!looks_through) return false;
  const auto* n = e.as<Binary>();
  return may_be_extreme(n->a, depth - 1) || may_be_extreme(n->b, depth - 1);
}

bool Sum::may_be_extreme() const {
  return std::ranges::any_of(terms,
                             [](const Term& term) { return ir::may_be_extreme(term.atom, 5); });
}

std::vector<Expr> operands_of(Kind kind, const Expr& e) {
  constexpr size_t max_operands = 8;
  std::vector<Expr> pending = {e}, operands;
  while (!pending.empty()) {
    const Expr next = pending.back();
    pending.pop_back();
    if (next.kind() == kind) {
      pending.push_back(next.as<Binary>()->b);
      pending.push_back(next.as<Binary>()->a);
    } else {
      operands.push_back(next);
    }
    if (pending.size() + operands.size() > max_operands) return {e};
  }
  return operands;
}

const Term* Sum::find(const Expr& atom) const {
  return first_where(terms, [&](const Term& term) { return equal(term.atom, atom); });
}

int64_t Sum::factor_of(const std::string& variable) const {
  for (const Term& term : terms) {
    const auto* v = term.atom.as<Variable>();
    if (v && v->name == variable) return term.factor;
  }
  return 0;
}

// Fits `value` to the type: wraps it or makes the sum invalid. Every number in a linear sum can be
// negated.
int64_t Sum::fit(__int128 value) {
  const int64_t wrapped = wrap_int(is_linear ? 64 : type.bits(), static_cast<int64_t>(value));
  if (is_linear) {
    valid = valid && wrapped == value && wrapped != INT64_MIN;
  } else if (is_index_type(type)) {
    valid = valid && wrapped == value && !is_extreme(type, wrapped);
  }
  return wrapped;
}

void Sum::add(const Expr& atom, int64_t factor) {
  const auto place =
      is_linear
          ? std::lower_bound(
                terms.begin(), terms.end(), atom,
                [](const Term& term, const Expr& sought) { return compare(term.atom, sought) < 0; })
          : std::ranges::find_if(terms, [&](const Term& term) { return equal(term.atom, atom); });
  const bool is_known = place != terms.end() && equal(place->atom, atom);
  const int64_t fitted = fit(__int128{is_known ? place->factor : 0} + factor);
  if (!is_known) {
    if (fitted != 0) terms.insert(place, {atom, fitted});
  } else if (fitted != 0) {
    place->factor = fitted;
  } else {
    terms.erase(place);
  }
}

void Sum::add_constant(__int128 value) { constant = fit(constant + value); }

void Sum::add(const Sum& other, int64_t factor) {
  valid = valid && other.valid;
  for (const Term& term : other.terms) {
    const int64_t fitted = fit(__int128{term.factor} * factor);
    if (fitted != 0) add(term.atom, fitted);
  }
  add_constant(__int128{other.constant} * factor);
}

Sum linear_sum(Type type, int64_t constant) {
  Sum result{type, {}, 0, true, true};
  result.add_constant(constant);
  return result;
}

Sum linear_sum(const Expr& atom, int64_t factor) {
  Sum result = linear_sum(atom.type(), 0);
  result.add(atom, factor);
  return result;
}

Sum sum_of(const Expr& e) {
  Sum sum;
  sum.type = e.type();
  if (Gatherer(sum).gather(e, 1) && sum.valid) return sum;
  Sum atom;  // too large or overflowing: the expression becomes one atom
  atom.type = e.type();
  atom.terms.push_back({e, 1});
  return atom;
}

Sum plus(const Sum& a, const Sum& b, int64_t factor_of_b) {
  Sum result = a;
  result.add(b, factor_of_b);
  return result;
}

Sum times(const Sum& a, int64_t factor) {
  Sum result{a.type, {}, 0, true, a.is_linear};
  result.add(a, factor);
  return result;
}

Sum constant_sum(Type type, int64_t value) {
  Sum result;
  result.type = type;
  result.add_constant(value);
  return result;
}

DividedSum divide_terms(const Sum& sum, int64_t divisor) {
  const Sum none{sum.type, {}, 0, true, sum.is_linear};
  DividedSum divided{none, none};
  divided.quotient.add_constant(euclidean_div(sum.constant, divisor));
  divided.remainder.add_constant(euclidean_mod(sum.constant, divisor));
  for (const Term& term : sum.terms) {
    if (term.factor % divisor == 0) {
      divided.quotient.add(term.atom, term.factor / divisor);
    } else {
      divided.remainder.add(term.atom, term.factor);
    }
  }
  return divided;
}

int64_t common_factor(const Sum& sum) {
  int64_t result = 0;
  for (const Term& term : sum.terms) result = std::gcd(result, term.factor);
  return result;
}

namespace {

bool fits_type(const Sum& sum) {
  const Type type = sum.type;
  return sum.valid && type.can_represent(sum.constant) &&
         std::ranges::all_of(sum.terms, [&](const Term& term) {
           return type.can_represent(term.factor) && type.can_represent(-term.factor);
         });
}

std::vector<Term> in_order_of_text(const Sum& sum) {
  std::vector<Term> terms = sum.terms;
  if (!sum.is_linear) {
    std::ranges::sort(terms,
                      [](const Term& a, const Term& b) { return canonical_less(a.atom, b.atom); });
  }
  std::ranges::stable_partition(terms, [](const Term& t) { return t.factor > 0; });
  return terms;
}

}  // namespace

Expr to_expr(const Sum& sum) {
  const bool is_atom = sum.terms.size() == 1 && sum.terms[0].factor == 1 && sum.constant == 0;
  if (sum.is_linear && is_atom && sum.valid) return sum.terms[0].atom;
  if (sum.is_linear && !fits_type(sum)) return {};
  const auto scaled = [&](const Expr& atom, int64_t factor) {
    return binary(Kind::Mul, atom, make_const(sum.type, factor));
  };
  const auto negatable = [&](int64_t value) {
    return value != INT64_MIN && !(sum.type.is_int() && value == sum.type.min_int());
  };
  int64_t constant = sum.constant;
  Expr result;
  for (const auto& [atom, factor] : in_order_of_text(sum)) {
    if (factor > 0) {
      result =
          result.defined() ? binary(Kind::Add, result, scaled(atom, factor)) : scaled(atom, factor);
      continue;
    }
    const bool leads = sum.is_linear ? constant != 0 : constant > 0 || factor == -1;
    if (!result.defined() && leads) result = make_const(sum.type, std::exchange(constant, 0));
    if (!result.defined())
      result = scaled(atom, factor);
    else if (negatable(factor))
      result = new Sub(sum.type, result, scaled(atom, -factor));
    else
      result = binary(Kind::Add, result, scaled(atom, factor));
  }
  if (!result.defined()) return make_const(sum.type, constant);
  // The most negative constant has no negation in a signed type.
  return constant < 0 && negatable(constant)
             ? binary(Kind::Sub, result, make_const(sum.type, -constant))
             : binary(Kind::Add, result, make_const(sum.type, constant));
}

}  // namespace retrograde::ir
