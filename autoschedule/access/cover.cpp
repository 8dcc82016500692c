#include "autoschedule/access/cover.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "ir/build.h"
#include "ir/scalar.h"

namespace retrograde::planning {

namespace {

using ir::ConstantRange;

constexpr double infinity = std::numeric_limits<double>::infinity();

bool contains(const std::vector<OpaqueTerm>& terms, const OpaqueTerm& term) {
  return std::ranges::find(terms, term) != terms.end();
}

// Numerators of indices, up to what all indices of a box have in common.
struct Span {
  double low = 0, high = 0;

  void add(double factor, double from, double to) {
    low += std::min(factor * from, factor * to);
    high += std::max(factor * from, factor * to);
  }
  void add(double factor, const ConstantRange& range) {
    add(factor, range.has_lower_bound() ? static_cast<double>(range.min) : -infinity,
        range.has_upper_bound() ? static_cast<double>(range.max) : infinity);
  }
};

// The extent of the box that holds the indices of one dimension.
class BoxExtent {
 public:
  BoxExtent(StageId stage, const Cover& cover, const SizeModel& sizes)
      : stage_(stage), cover_(cover), sizes_(sizes) {}

  int64_t of(const std::vector<const IndexForm*>& forms, int64_t whole) const {
    const IndexForm& first = *forms[0];
    const bool are_alike = std::ranges::all_of(forms, [&](const IndexForm* form) {
      return form->divisor == first.divisor && form->modulus == first.modulus;
    });
    const double reach = are_alike ? reach_of(forms) : infinity;
    whole = std::min(whole, length_of_all(forms, are_alike));
    return reach < static_cast<double>(whole) ? static_cast<int64_t>(reach) : whole;
  }

 private:
  const StageId stage_;
  const Cover& cover_;
  const SizeModel& sizes_;

  int64_t points(int iterator) const { return cover_[static_cast<size_t>(iterator)]; }
  bool is_moved(const OpaqueTerm& term) const {
    return std::ranges::any_of(term.value.iterators, [&](int16_t i) { return points(i) > 1; });
  }

  // Between the ends of clamps, and of the whole loops where the forms have nothing in common.
  int64_t length_of_all(const std::vector<const IndexForm*>& forms, bool are_alike) const {
    ConstantRange all{INT64_MAX, INT64_MIN};
    for (const IndexForm* form : forms)
      all = hull(all, are_alike ? sizes_.range(form->within) : sizes_.range(*form, stage_));
    return all.is_bounded() ? std::max<int64_t>(all.extent(), 1) : INT64_MAX;
  }

  double reach_of(const std::vector<const IndexForm*>& forms) const {
    const IndexForm& first = *forms[0];
    Span all{infinity, -infinity};
    for (const IndexForm* form : forms) {
      const Span span = span_of(*form, first);
      all = {std::min(all.low, span.low), std::max(all.high, span.high)};
    }
    double reach = all.high - all.low + 1;
    const auto divisor = static_cast<double>(first.divisor);
    if (first.divisor != 1)
      reach = std::floor((latest_start(first, all.low, first.divisor) + reach - 1) / divisor) + 1;
    if (first.modulus == 0 || reach <= 1) return reach;
    const auto modulus = static_cast<double>(first.modulus);
    const double start = latest_start(first, all.low, first.divisor * first.modulus);
    const bool wraps = std::floor(start / divisor) + reach > modulus;
    return wraps ? modulus : reach;
  }

  // Where iterators stand still, or their coefficients are equal, both forms move together.
  Span span_of(const IndexForm& form, const IndexForm& first) const {
    Span span{static_cast<double>(form.low), static_cast<double>(form.high)};
    for (const Term& term : form.terms)
      span.add(double(term.coefficient), 0, double(points(term.iterator) - 1));
    for (const Term& term : form.terms)
      add_drift(span, term.iterator, term.coefficient - first.coefficient(term.iterator));
    for (const Term& term : first.terms) {
      if (form.coefficient(term.iterator) == 0) add_drift(span, term.iterator, -term.coefficient);
    }
    for (const OpaqueTerm& term : form.opaque) {
      const bool is_common = !is_moved(term) && contains(first.opaque, term);
      if (!is_common) span.add(double(term.coefficient), sizes_.range(term.range));
    }
    for (const OpaqueTerm& term : first.opaque) {
      const bool is_common = is_moved(term) || contains(form.opaque, term);
      if (!is_common) span.add(double(-term.coefficient), sizes_.range(term.range));
    }
    return span;
  }
  void add_drift(Span& span, int iterator, int64_t coefficient) const {
    if (coefficient == 0) return;
    const ConstantRange loop = sizes_.range(stage_, iterator);
    span.add(double(coefficient), {loop.min, std::max(loop.min, loop.max - points(iterator) + 1)});
  }

  // The largest remainder by the period that the first numerator of a piece has: pieces lie as far apart as they are long.
  double latest_start(const IndexForm& form, double low, int64_t period) const {
    int64_t apart = period, sum = 0;
    for (const Term& term : form.terms) {
      apart = std::gcd(apart, term.coefficient * points(term.iterator));
      sum += term.coefficient % period * (sizes_.range(stage_, term.iterator).min % period);
    }
    if (!form.opaque.empty()) apart = 1;
    sum += static_cast<int64_t>(std::clamp(low, -1e15, 1e15)) % period;
    return static_cast<double>(period - apart + ir::euclidean_mod(sum, apart));
  }
};

}  // namespace

Cover whole_cover(StageId stage, const SizeModel& sizes) {
  Cover cover(sizes.graph().stage(stage).iterators.size());
  for (size_t i = 0; i < cover.size(); ++i)
    cover[i] = std::max<int64_t>(sizes.of(stage, static_cast<int>(i)).estimate, 1);
  return cover;
}

Cover cover_of_box(StageId stage, const std::vector<int64_t>& box, const SizeModel& sizes) {
  Cover cover = whole_cover(stage, sizes);
  const std::vector<Iterator>& iterators = sizes.graph().stage(stage).iterators;
  for (size_t i = 0; i < cover.size(); ++i) {
    if (iterators[i].kind == Iterator::Kind::Pure)
      cover[i] = box[static_cast<size_t>(iterators[i].dimension)];
  }
  return cover;
}

std::vector<int64_t> extents(const Access& access, const Cover& cover, const SizeModel& sizes) {
  return extents(std::vector{&access}, cover, sizes);
}

std::vector<int64_t> extents(const std::vector<const Access*>& accesses, const Cover& cover,
                             const SizeModel& sizes) {
  const Access& first = *accesses[0];
  const BoxExtent box(first.by, cover, sizes);
  std::vector<int64_t> result;
  for (size_t d = 0; d < first.index.size(); ++d) {
    const auto forms = ir::mapped(accesses, [&](const Access* a) { return &a->index[d]; });
    result.push_back(box.of(forms, std::max<int64_t>(sizes.of(first, d).estimate, 1)));
  }
  return result;
}

}  // namespace retrograde::planning
