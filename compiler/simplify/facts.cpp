// Variables and conditions: the ends that are known of variables, and the sums and conditions that hold.
#include "simplify/facts.h"

#include <algorithm>

#include "ir/build.h"
#include "ir/equal.h"
#include "ir/scalar.h"
#include "ir/visit.h"

namespace retrograde::simplification {

void Facts::bind(const std::string& name, Expr min, Expr max) {
  ConstantRange range;
  if (min.defined()) range.min = this->range(min).min;
  if (max.defined()) range.max = this->range(max).max;
  Congruence congruence;
  if (min.defined() && min.same_as(max)) congruence = this->congruence(min);
  variables_[name] = Bounds{{std::move(min), std::move(max)}, range, congruence, next_order_++};
}

void Facts::unbind(const std::string& name) { variables_.erase(name); }

Expr Facts::min_of(const std::string& name) const {
  const auto found = variables_.find(name);
  return found == variables_.end() ? Expr() : found->second.min;
}

Expr Facts::value_of(const std::string& name) const {
  const auto found = variables_.find(name);
  const bool is_one = found != variables_.end() && found->second.min.same_as(found->second.max);
  return is_one ? found->second.min : Expr();
}

namespace {

// A hash of the terms in any order, with factors relative to `divisor`.
uint64_t terms_key(const std::vector<Term>& terms, int64_t divisor) {
  uint64_t key = terms.size();
  for (const Term& term : terms) {
    key += (hash(term.atom) | 1) *
           (static_cast<uint64_t>(term.factor / divisor) * 0x9e3779b97f4a7c15ull + 1);
  }
  return key;
}

bool same_terms(const std::vector<Term>& terms, const Sum& sum, int64_t divisor) {
  if (terms.size() != sum.terms.size()) return false;
  for (const Term& term : sum.terms) {
    const auto matches = [&](const Term& other) {
      return other.factor == term.factor / divisor && equal(other.atom, term.atom);
    };
    if (std::ranges::none_of(terms, matches)) return false;
  }
  return true;
}

}  // namespace

void Facts::add(uint64_t key, Known known) {
  index_.emplace(key, known_.size());
  known_.push_back(std::move(known));
}

void Facts::assume_at_most(Sum sum, int64_t bound) {
  if (!sum.valid || sum.is_constant()) return;
  const int64_t divisor = common_factor(sum);
  bound = euclidean_div(saturate(__int128{bound} - sum.constant), divisor);
  const uint64_t key = terms_key(sum.terms, divisor);
  for (Term& term : sum.terms) term.factor /= divisor;
  add(key, Known{std::move(sum.terms), bound, {}, true});
}

bool Facts::is_older(const Expr& e, int order) const {
  return !any_node(e, [&](const Variable& name) {
    const auto found = variables_.find(name.name);
    return found != variables_.end() && found->second.order >= order;
  });
}

// low + gap <= high, where low is a loop's variable, gives it a new upper end. The old one is kept,
// as it may be tighter.
void Facts::narrow(const Expr& low, const Expr& high, int64_t gap) {
  const auto* name = low.as<Variable>();
  const auto found = name ? variables_.find(name->name) : variables_.end();
  if (found == variables_.end() || is_const(high)) return;
  Bounds& bounds = found->second;
  if (!bounds.max.defined() || bounds.min.same_as(bounds.max) || !is_older(high, bounds.order))
    return;
  narrowed_.push_back({name->name, bounds});
  const Expr end = binary(Kind::Sub, high, make_const(high.type(), gap));
  bounds.max = binary(Kind::Min, end, bounds.max);
}

void Facts::assume_comparison(const Binary& n, bool value) {
  if (!is_index_type(n.a.type()) || n.a.type().is_vector()) return;
  const Sum difference = plus(sum_of(n.a), sum_of(n.b), -1);
  const Sum opposite = times(difference, -1);
  switch (n.kind) {
    case Kind::LT:
      value ? narrow(n.a, n.b, 1) : narrow(n.b, n.a, 0);
      return value ? assume_at_most(difference, -1) : assume_at_most(opposite, 0);
    case Kind::LE:
      value ? narrow(n.a, n.b, 0) : narrow(n.b, n.a, 1);
      return value ? assume_at_most(difference, 0) : assume_at_most(opposite, -1);
    case Kind::EQ:
    case Kind::NE:
      if (value != (n.kind == Kind::EQ)) return;
      assume_congruent(n.a, n.b);
      assume_at_most(difference, 0);
      return assume_at_most(opposite, 0);
    default:
      return;
  }
}

void Facts::assume(const Expr& condition, bool value) {
  const Kind splits = value ? Kind::And : Kind::Or;
  if (condition.kind() == splits) {
    const auto* both = condition.as<Binary>();
    assume(both->a, value);
    assume(both->b, value);
    return;
  }
  if (const auto* negation = condition.as<Not>()) return assume(negation->a, !value);
  if (const auto* call = condition.as<Call>(); call && call->is_likely())
    return assume(call->args[0], value);
  if (is_const(condition)) return;
  add(hash(condition), Known{{}, 0, condition, value});
  if (const auto* comparison = condition.as<Binary>()) assume_comparison(*comparison, value);
}

void Facts::assume(const Expr& condition) {
  assume(condition, true);
  forget();
}

Facts::Assumption::Assumption(Facts& facts, const Expr& condition)
    : facts_(facts),
      first_(facts.known_.size()),
      first_congruent_(facts.congruent_.size()),
      first_narrowed_(facts.narrowed_.size()) {
  if (condition.defined()) facts_.assume(condition);
}

Facts::Assumption::~Assumption() {
  if (facts_.known_.size() == first_) return;
  for (auto it = facts_.index_.begin(); it != facts_.index_.end();) {
    it = it->second >= first_ ? facts_.index_.erase(it) : std::next(it);
  }
  facts_.known_.resize(first_);
  facts_.congruent_.resize(first_congruent_);
  for (; facts_.narrowed_.size() > first_narrowed_; facts_.narrowed_.pop_back()) {
    const Narrowed& last = facts_.narrowed_.back();
    if (const auto it = facts_.variables_.find(last.name); it != facts_.variables_.end())
      it->second = last.before;
  }
  facts_.forget();
}

std::optional<bool> Facts::decided(const Expr& condition) const {
  if (known_.empty()) return std::nullopt;
  const auto [first, last] = index_.equal_range(hash(condition));
  for (auto it = first; it != last; ++it) {
    const Known& known = known_[it->second];
    if (known.condition.defined() && equal(known.condition, condition)) return known.value;
  }
  return std::nullopt;
}

int64_t Facts::known_bound(const Sum& sum) const {
  if (index_.empty() || sum.is_constant()) return infinity;
  const int64_t divisor = common_factor(sum);
  int64_t best = infinity;
  const auto [first, last] = index_.equal_range(terms_key(sum.terms, divisor));
  for (auto it = first; it != last; ++it) {
    const Known& known = known_[it->second];
    if (known.condition.defined() || !same_terms(known.terms, sum, divisor)) continue;
    best = std::min(best, saturate(__int128{known.bound} * divisor + sum.constant));
  }
  return best;
}

int64_t Facts::known_bound(const Expr& atom, int64_t factor) const {
  Sum sum;
  sum.type = atom.type();
  sum.terms.push_back({atom, factor});
  return known_bound(sum);
}

}  // namespace retrograde::simplification
