// Gathering and rebuilding sums.
#include "simplify/sum.h"

#include <algorithm>
#include <numeric>

#include "ir/build.h"
#include "ir/equal.h"

namespace retrograde::ir {

namespace {

int64_t sign_extend(int bits, int64_t value) {
  if (bits >= 64) return value;
  return static_cast<int64_t>(static_cast<uint64_t>(value) << (64 - bits)) >> (64 - bits);
}

// Puts `value` into the type: wraps, or makes the sum of an index type invalid when it becomes
// extreme.
int64_t fit(Sum& sum, __int128 value) {
  const int64_t wrapped = sign_extend(sum.type.bits(), static_cast<int64_t>(value));
  if (is_index_type(sum.type) && (wrapped != value || is_extreme(sum.type, wrapped)))
    sum.valid = false;
  return wrapped;
}

// Adds factor * e; false when that takes too many steps or terms.
class Gatherer {
 public:
  explicit Gatherer(Sum& sum) : sum_(sum) {}

  bool gather(const Expr& e, int64_t factor) {
    if (++steps_ > 3 * max_terms) return false;
    if (const std::optional<int64_t> value = as_const_int(e)) {
      sum_.constant = fit(sum_, __int128{sum_.constant} + __int128{*value} * factor);
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

// Structural order would be nicer to read, but may look at all of both trees.
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
  return std::any_of(terms.begin(), terms.end(),
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

int64_t floor_div(int64_t a, int64_t b) { return a / b - (a % b < 0 ? 1 : 0); }
int64_t floor_mod(int64_t a, int64_t b) { return a % b + (a % b < 0 ? b : 0); }

const Term* Sum::find(const Expr& atom) const {
  for (const Term& term : terms) {
    if (equal(term.atom, atom)) return &term;
  }
  return nullptr;
}

void Sum::add(const Expr& atom, int64_t factor) {
  for (size_t i = 0; i < terms.size(); ++i) {
    if (!equal(terms[i].atom, atom)) continue;
    terms[i].factor = fit(*this, __int128{terms[i].factor} + factor);
    if (terms[i].factor == 0) terms.erase(terms.begin() + static_cast<std::ptrdiff_t>(i));
    return;
  }
  const int64_t fitted = fit(*this, factor);
  if (fitted != 0) terms.push_back({atom, fitted});
}

void Sum::add_constant(int64_t value) { constant = fit(*this, __int128{constant} + value); }

void Sum::add(const Sum& other, int64_t factor) {
  valid = valid && other.valid;
  for (const Term& term : other.terms) {
    const __int128 product = __int128{term.factor} * factor;
    const int64_t fitted = fit(*this, product);
    if (fitted != 0) add(term.atom, fitted);
  }
  constant = fit(*this, __int128{constant} + __int128{other.constant} * factor);
}

Sum sum_of(const Expr& e) {
  Sum sum;
  sum.type = e.type();
  if (Gatherer(sum).gather(e, 1) && sum.valid) return sum;
  Sum atom;  // too large or overflowing: taken as a whole
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
  Sum result;
  result.type = a.type;
  result.add(a, factor);
  return result;
}

Sum constant_sum(Type type, int64_t value) {
  Sum result;
  result.type = type;
  result.add_constant(value);
  return result;
}

int64_t common_factor(const Sum& sum) {
  int64_t result = 0;
  for (const Term& term : sum.terms) result = std::gcd(result, term.factor);
  return result;
}

Expr to_expr(const Sum& sum) {
  std::vector<Term> terms = sum.terms;
  std::sort(terms.begin(), terms.end(), [](const Term& a, const Term& b) {
    if ((a.factor > 0) != (b.factor > 0)) return a.factor > 0;
    return canonical_less(a.atom, b.atom);
  });
  const auto scaled = [&](const Expr& atom, int64_t factor) {
    return binary(Kind::Mul, atom, make_const(sum.type, factor));
  };
  int64_t constant = sum.constant;
  Expr result;
  for (const auto& [atom, factor] : terms) {
    if (factor > 0) {
      result =
          result.defined() ? binary(Kind::Add, result, scaled(atom, factor)) : scaled(atom, factor);
      continue;
    }
    if (!result.defined() && (constant > 0 || factor == -1))
      result = make_const(sum.type, std::exchange(constant, 0));
    const bool negatable =
        factor != INT64_MIN && !(sum.type.is_int() && factor == sum.type.min_int());
    if (!result.defined())
      result = scaled(atom, factor);
    else if (negatable)
      result = new Sub(sum.type, result, scaled(atom, -factor));
    else
      result = binary(Kind::Add, result, scaled(atom, factor));
  }
  if (!result.defined()) return make_const(sum.type, constant);
  // The most negative constant has no negation in a signed type.
  const bool negatable = constant < 0 && constant != INT64_MIN &&
                         !(sum.type.is_int() && constant == sum.type.min_int());
  return negatable ? binary(Kind::Sub, result, make_const(sum.type, -constant))
                   : binary(Kind::Add, result, make_const(sum.type, constant));
}

}  // namespace retrograde::ir
