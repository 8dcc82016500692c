#include "autoschedule/access/index_form.h"

#include <algorithm>
#include <numeric>

#include "ir/scalar.h"

namespace retrograde::planning {

int64_t IndexForm::coefficient(int iterator) const {
  const Term* term = ir::first_where(terms, [&](const Term& t) { return t.iterator == iterator; });
  return term ? term->coefficient : 0;
}

IteratorSet IndexForm::moved_by() const {
  IteratorSet result = 0;
  for (const Term& term : terms) result |= set_of(term.iterator);
  for (const OpaqueTerm& term : opaque) result |= term.value.depends();
  return result;
}

IteratorSet IndexForm::data_loops() const {
  IteratorSet result = 0;
  for (const OpaqueTerm& term : opaque) {
    if (term.value.from_data) result |= term.value.depends();
  }
  return result;
}

bool IndexForm::has_data() const {
  return std::ranges::any_of(opaque, [](const OpaqueTerm& t) { return t.value.from_data; });
}

bool IndexForm::same_parts(const IndexForm& other) const {
  return terms == other.terms && opaque == other.opaque && divisor == other.divisor &&
         modulus == other.modulus;
}

bool IndexForm::operator==(const IndexForm& other) const {
  return same_parts(other) && low == other.low && high == other.high && clamped == other.clamped;
}

IndexForm constant_form(int64_t value) {
  IndexForm result;
  result.low = result.high = value;
  return result;
}

IndexForm iterator_form(int iterator) {
  IndexForm result;
  result.terms.push_back({static_cast<int16_t>(iterator), 1});
  return result;
}

IndexForm opaque_form(OpaqueTerm term) {
  IndexForm result;
  result.opaque.push_back(std::move(term));
  return result;
}

namespace {

// Arithmetic that notices when a number does not fit.
class Checked {
 public:
  int64_t product(int64_t a, int64_t b) {
    int64_t result = 0;
    fits_ = !__builtin_mul_overflow(a, b, &result) && fits_;
    return result;
  }
  int64_t sum(int64_t a, int64_t b) {
    int64_t result = 0;
    fits_ = !__builtin_add_overflow(a, b, &result) && fits_;
    return result;
  }
  bool fits() const { return fits_; }

 private:
  bool fits_ = true;
};

// Adds a term to a list that `key` orders.
template <class T, class Key>
void add_term(std::vector<T>& list, const T& term, Key key, Checked& checked) {
  const auto place = std::ranges::lower_bound(list, std::invoke(key, term), {}, key);
  if (place == list.end() || std::invoke(key, *place) != std::invoke(key, term)) {
    list.insert(place, term);
    return;
  }
  place->coefficient = checked.sum(place->coefficient, term.coefficient);
  if (place->coefficient == 0) list.erase(place);
}

void scale(IndexForm& form, int64_t factor, Checked& checked) {
  for (Term& term : form.terms) term.coefficient = checked.product(term.coefficient, factor);
  for (OpaqueTerm& term : form.opaque) term.coefficient = checked.product(term.coefficient, factor);
  form.low = checked.product(form.low, factor);
  form.high = checked.product(form.high, factor);
  if (factor < 0) std::swap(form.low, form.high);
}

std::optional<IndexForm> if_fits(IndexForm form, const Checked& checked) {
  form.within = {};
  form.expr = {};
  return checked.fits() ? std::optional(std::move(form)) : std::nullopt;
}

// (d * q + r) / d is q + r / d: divides by what the divisor and all coefficients have in common.
void reduce(IndexForm& form) {
  int64_t common = form.divisor;
  for (const Term& term : form.terms) common = std::gcd(common, term.coefficient);
  for (const OpaqueTerm& term : form.opaque) common = std::gcd(common, term.coefficient);
  if (common == 1) return;
  for (Term& term : form.terms) term.coefficient /= common;
  for (OpaqueTerm& term : form.opaque) term.coefficient /= common;
  form.low = ir::euclidean_div(form.low, common);
  form.high = ir::euclidean_div(form.high, common);
  form.divisor /= common;
}

}  // namespace

// A quotient takes the other summand inside: a / d + b is (a + d * b) / d.
std::optional<IndexForm> plus(const IndexForm& a, const IndexForm& b) {
  if (a.modulus != 0 || b.modulus != 0 || (a.divisor != 1 && b.divisor != 1)) return std::nullopt;
  Checked checked;
  IndexForm result = a.divisor != 1 ? a : b, other = a.divisor != 1 ? b : a;
  scale(other, result.divisor, checked);
  for (const Term& term : other.terms) add_term(result.terms, term, &Term::iterator, checked);
  for (const OpaqueTerm& term : other.opaque)
    add_term(result.opaque, term, &OpaqueTerm::value, checked);
  result.low = checked.sum(result.low, other.low);
  result.high = checked.sum(result.high, other.high);
  result.clamped = a.clamped || b.clamped;
  result.turned = a.turned || b.turned;
  return if_fits(std::move(result), checked);
}

// The negative of a quotient rounds up: -(a / d) is (d - 1 - a) / d.
std::optional<IndexForm> scaled(const IndexForm& a, int64_t factor) {
  if (factor == 1) return a;
  if (factor == 0) return constant_form(0);
  if (a.modulus != 0 || (a.divisor != 1 && factor != -1)) return std::nullopt;
  Checked checked;
  IndexForm result = a;
  scale(result, factor, checked);
  result.low = checked.sum(result.low, a.divisor - 1);
  result.high = checked.sum(result.high, a.divisor - 1);
  return if_fits(std::move(result), checked);
}

std::optional<IndexForm> quotient(const IndexForm& a, int64_t divisor) {
  if (divisor == 1) return a;
  if (a.modulus != 0) return std::nullopt;
  Checked checked;
  IndexForm result = a;
  result.divisor = checked.product(a.divisor, divisor);
  if (checked.fits()) reduce(result);
  return if_fits(std::move(result), checked);
}

std::optional<IndexForm> remainder(const IndexForm& a, int64_t modulus) {
  if (a.modulus != 0) return std::nullopt;
  Checked checked;
  IndexForm result = a;
  const int64_t period = checked.product(a.divisor, modulus);
  if (!checked.fits()) return std::nullopt;
  std::erase_if(result.terms, [&](const Term& t) { return t.coefficient % period == 0; });
  std::erase_if(result.opaque, [&](const OpaqueTerm& t) { return t.coefficient % period == 0; });
  if (result.low == result.high) result.low = result.high = ir::euclidean_mod(a.low, period);
  if (result.is_constant()) {
    if (result.low != result.high) return std::nullopt;
    return constant_form(result.low / a.divisor);
  }
  result.modulus = modulus;
  return if_fits(std::move(result), checked);
}

std::optional<IndexForm> hull(const IndexForm& a, const IndexForm& b) {
  if (!a.same_parts(b)) return std::nullopt;
  IndexForm result = a;
  result.low = std::min(a.low, b.low);
  result.high = std::max(a.high, b.high);
  result.clamped = a.clamped || b.clamped;
  result.turned = a.turned || b.turned;
  return result;
}

Value value_of(const IndexForm& form, ValueNumbers& numbers,
               ir::FunctionRef<Value(const OpaqueTerm&)> value_of_term) {
  ValueNumbers::Words what{form_key, static_cast<uint64_t>(form.low),
                           static_cast<uint64_t>(form.high), static_cast<uint64_t>(form.divisor),
                           static_cast<uint64_t>(form.modulus)};
  std::vector<Value> parts;
  for (const Term& term : form.terms) {
    what.push_back(static_cast<uint64_t>(term.coefficient));
    parts.push_back(ValueNumbers::iterator(term.iterator));
  }
  for (const OpaqueTerm& term : form.opaque) {
    what.push_back(static_cast<uint64_t>(term.coefficient));
    parts.push_back(value_of_term(term));
  }
  return numbers.combine(std::move(what), pointers_to(parts));
}

}  // namespace retrograde::planning
