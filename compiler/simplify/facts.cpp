// Constant ranges of expressions, and bounds of sums by elimination.
//
// To bound a sum from above, terms are replaced one by one by an upper bound: a variable by its
// upper end, c * (x / c) by x, a minimum by either operand, a maximum or a select by the worse of
// its operands. Cancellation after a replacement makes the bound tight. Each replacement costs one
// unit of a fixed budget.
#include "simplify/facts.h"

#include <algorithm>

#include "ir/build.h"
#include "ir/equal.h"
#include "ir/scalar.h"
#include "ir/visit.h"

namespace retrograde::simplification {

// ---- constant ranges ----

namespace {

constexpr int64_t infinity = INT64_MAX;

int64_t saturate(__int128 value) {
  return value > INT64_MAX   ? INT64_MAX
         : value < INT64_MIN ? INT64_MIN
                             : static_cast<int64_t>(value);
}
bool is_infinite(int64_t value) { return value == INT64_MAX || value == INT64_MIN; }

int64_t add_ends(int64_t a, int64_t b) {
  if (is_infinite(a)) return a;
  return is_infinite(b) ? b : saturate(__int128{a} + b);
}

// Uses 0 * infinity = 0.
int64_t multiply_ends(int64_t a, int64_t b) {
  if (a == 0 || b == 0) return 0;
  if (is_infinite(a) || is_infinite(b)) return (a < 0) == (b < 0) ? INT64_MAX : INT64_MIN;
  return saturate(__int128{a} * b);
}

int64_t divide_ends(int64_t a, int64_t b) { return is_infinite(a) ? a : euclidean_div(a, b); }

}  // namespace

ConstantRange range_of(Type type) {
  return type.is_int_or_uint() ? ConstantRange{type.min_int(), type.max_int()} : ConstantRange();
}

ConstantRange operator+(const ConstantRange& a, const ConstantRange& b) {
  return {add_ends(a.min, b.min), add_ends(a.max, b.max)};
}
ConstantRange operator*(const ConstantRange& a, int64_t factor) {
  const int64_t x = multiply_ends(a.min, factor), y = multiply_ends(a.max, factor);
  return {std::min(x, y), std::max(x, y)};
}

namespace {

ConstantRange multiply(const ConstantRange& a, const ConstantRange& b) {
  return hull(a * b.min, a * b.max);
}

// Division by b > 0 rounds down and is monotonic in each operand, so the corners suffice. Otherwise
// only
// a / b| <= |a| is used.
ConstantRange divide(const ConstantRange& a, const ConstantRange& b) {
  if (b.min > 0) {
    const int64_t high = b.max == infinity ? infinity : b.max;
    const auto far = [&](int64_t end) {
      return end < 0 ? -1 : 0;
    };  // the limit for an unbounded divisor
    const int64_t corners[] = {divide_ends(a.min, b.min), divide_ends(a.max, b.min),
                               high == infinity ? far(a.min) : divide_ends(a.min, high),
                               high == infinity ? far(a.max) : divide_ends(a.max, high)};
    return {*std::min_element(corners, corners + 4), *std::max_element(corners, corners + 4)};
  }
  if (is_infinite(a.min) || is_infinite(a.max)) return {};
  const int64_t largest = std::max(std::abs(a.min), std::abs(a.max));
  return {-largest, largest};
}

ConstantRange modulo(const ConstantRange& a, const ConstantRange& b) {
  if (b.min > 0 && a.min >= 0 && a.max < b.min) return a;
  if (is_infinite(b.min) || is_infinite(b.max)) return {0, a.min >= 0 ? a.max : infinity};
  const int64_t largest = std::max<int64_t>({std::abs(b.min), std::abs(b.max), 1}) - 1;
  return {0, a.min >= 0 ? std::min(largest, a.max) : largest};
}

ConstantRange wrapped(const ConstantRange& r, Type type) {
  const ConstantRange all_values = range_of(type);
  if (is_index_type(type)) return intersection(r, all_values);  // does not overflow
  // The largest uint64 exceeds int64, so the type's range has no upper end, and sums may wrap.
  if (type.is_uint() && type.bits() == 64 && r.max == infinity) return all_values;
  return r.is_within(all_values) ? r : all_values;
}

}  // namespace

ConstantRange Facts::range(const Expr& e) {
  if (const std::optional<int64_t> value =
          as_const_int(e)) {  // the extremes of int64 also represent infinity
    return {*value == INT64_MAX ? *value - 1 : *value, *value == INT64_MIN ? *value + 1 : *value};
  }
  if (!e.type().is_int_or_uint()) return {};
  return ranges_.get(e, [&] {
    const ConstantRange all_values = range_of(e.type());
    const ConstantRange result = intersection(range_of_node(e), all_values);
    return result.min > result.max ? all_values : result;  // contradictory facts: unreachable code
  });
}

ConstantRange Facts::range_of_variable(const Expr& e, const Variable& n) {
  ConstantRange result;
  if (const auto found = variables_.find(n.name); found != variables_.end())
    result = found->second.range;
  if (!index_.empty() && is_index_type(n.type)) {
    const int64_t low = known_bound(e, -1);
    result = intersection(result, {low == infinity ? INT64_MIN : -low, known_bound(e, 1)});
  }
  return result;
}

ConstantRange Facts::range_of_node(const Expr& e) {
  const ConstantRange all_values = range_of(e.type());
  return match(
      e, [&](const Variable& n) { return range_of_variable(e, n); },
      [&](const Cast& n) {
        if (!n.value.type().is_int_or_uint() || n.type.is_bool()) return all_values;
        const ConstantRange source = range(n.value);
        return source.is_within(all_values) &&
                       !(n.value.type() == UInt(64) && source.max == infinity)
                   ? source
                   : all_values;
      },
      [&](const Binary& n) { return range_of_binary(n); },
      [&](const Select& n) { return hull(range(n.when_true), range(n.when_false)); },
      [&](const Ramp& n) {
        const ConstantRange steps = multiply(range(n.stride), {0, n.lanes - 1});
        return wrapped(range(n.base) + steps, n.type);
      },
      [&](const Broadcast& n) { return range(n.value); },
      [&](const Let& n) { return range(n.body); },
      [&](const VectorReduce& n) {
        return n.op == Kind::Min || n.op == Kind::Max ? range(n.value) : all_values;
      },
      [&](const Shuffle& n) {
        ConstantRange result = range(n.vectors[0]);
        for (const Expr& v : n.vectors) result = hull(result, range(v));
        return result;
      },
      [&](const Call& n) { return range_of_call(n); }, [&](const ExprNode&) { return all_values; });
}

ConstantRange Facts::range_of_binary(const Binary& n) {
  const ConstantRange all_values = range_of(n.type);
  if (!n.a.type().is_int_or_uint() || n.type.is_bool()) return all_values;
  const ConstantRange a = range(n.a), b = range(n.b);
  switch (n.kind) {
    case Kind::Add:
      return wrapped(a + b, n.type);
    case Kind::Sub:
      return wrapped(a + b * -1, n.type);
    case Kind::Mul:
      return wrapped(multiply(a, b), n.type);
    case Kind::Div:
      return wrapped(divide(a, b), n.type);
    case Kind::Mod:
      return modulo(a, b);
    case Kind::Min:
      return {std::min(a.min, b.min), std::min(a.max, b.max)};
    case Kind::Max:
      return {std::max(a.min, b.min), std::max(a.max, b.max)};
    default:
      return all_values;
  }
}

ConstantRange Facts::range_of_call(const Call& n) {
  const ConstantRange all_values = range_of(n.type);
  if (n.call_type != CallType::Operator) return all_values;
  switch (n.op) {
    case Op::promise_clamped:
    case Op::unsafe_promise_clamped:
      return intersection(range(n.args[0]), {range(n.args[1]).min, range(n.args[2]).max});
    case Op::bitwise_and: {  // at most a nonnegative constant operand
      const ConstantRange mask = range(n.args[1]);
      return mask.min >= 0 ? ConstantRange{0, mask.max} : all_values;
    }
    case Op::popcount:
    case Op::count_leading_zeros:
    case Op::count_trailing_zeros:
      return {0, n.type.bits()};
    case Op::if_then_else:
      return hull(range(n.args[1]), range(n.args[2]));
    default:
      return n.is_marker() ? range(n.args[0]) : all_values;
  }
}

// ---- variables and conditions ----

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

// ---- bounds of sums ----

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

// f * (x / c) with c dividing f: at most (f / c) * x for f > 0, and (f / c) * (x - (c - 1)) for f <
// 0.
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
