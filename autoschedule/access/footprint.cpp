#include "autoschedule/access/footprint.h"

#include <algorithm>
#include <cmath>

namespace retrograde::planning {

namespace {

double points(const Cover& cover, int iterator) {
  return static_cast<double>(cover[static_cast<size_t>(iterator)]);
}

// The elements along one dimension: how many, and from the first to the last one.
struct Window {
  double points = 1, reach = 1;
  bool is_dense() const { return points >= reach; }
};

void add_loop(Window& window, double step, double count) {
  // Windows that touch or overlap make one.
  const bool joins = window.is_dense() && step <= window.reach;
  window.reach += step * (count - 1);
  window.points = joins ? window.reach : std::min(window.points * count, window.reach);
}

// `reach` is known. Elements that the loops leave out on the way are not touched.
Window window_of(const IndexForm& form, const Cover& cover, int64_t reach) {
  Window window;
  window.points = window.reach = static_cast<double>(form.high - form.low + 1);
  std::vector<Term> terms = form.terms;
  std::ranges::sort(terms, {}, [](const Term& t) { return std::abs(t.coefficient); });
  for (const Term& term : terms)
    add_loop(window, static_cast<double>(std::abs(term.coefficient)), points(cover, term.iterator));
  for (const OpaqueTerm& term : form.opaque) {
    for (const int16_t i : term.value.iterators) window.points *= points(cover, i);
  }
  window.reach = static_cast<double>(reach);
  window.points = std::min(window.points, window.reach);
  return window;
}

// At most one element for each iteration and tap.
double iterations_of(const Access& access, const Cover& cover) {
  double result = 1;
  for (size_t i = 0; i < cover.size(); ++i) {
    if (access.moved_by() & set_of(static_cast<int>(i)))
      result *= points(cover, static_cast<int>(i));
  }
  for (const IndexForm& form : access.index)
    result *= static_cast<double>(form.high - form.low + 1);
  return result;
}

bool moves(const IndexForm& form, int iterator) {
  return (form.moved_by() & set_of(iterator)) != 0;
}

bool is_moved_by_data(const IndexForm& form, int iterator) {
  return std::ranges::any_of(form.opaque, [&](const OpaqueTerm& t) {
    return (t.value.depends() & set_of(iterator)) != 0;
  });
}

// Elements of a dimension from one iteration to the next.
double step_of(const IndexForm& form, int iterator) {
  return static_cast<double>(form.coefficient(iterator)) / static_cast<double>(form.divisor);
}

}  // namespace

Footprint footprint(const Access& access, const Cover& cover, const SizeModel& sizes,
                    LineSize line) {
  const auto in_line = static_cast<double>(line.elements);
  const std::vector<int64_t> box = extents(access, cover, sizes);
  Footprint result;
  double run = 1;        // elements that lie together
  bool is_whole = true;  // all dimensions so far are touched from end to end
  for (size_t d = 0; d < access.index.size(); ++d) {
    const Window window = window_of(access.index[d], cover, box[d]);
    result.elements *= window.points;
    if (d == 0)
      result.lines = std::min(window.points, std::ceil(window.reach / in_line));
    else
      result.lines *= window.points;
    if (is_whole && window.is_dense()) {
      run *= window.points;
      result.lines = std::min(result.lines, std::ceil(run / in_line));
    }
    is_whole = is_whole && window.points >= double(sizes.of(access, d).estimate);
  }
  result.elements = std::min(result.elements, iterations_of(access, cover));
  result.lines = std::min(result.lines, result.elements);
  return result;
}

Reuse reuse(const Access& access, int iterator, const Cover& inner, const SizeModel& sizes,
            LineSize line) {
  Reuse result;
  result.temporal = (access.moved_by() & set_of(iterator)) == 0;
  if (result.temporal) return result;
  const std::vector<int64_t> box = extents(access, inner, sizes);
  result.spatial = result.overlap = true;
  for (size_t d = 0; d < access.index.size(); ++d) {
    const IndexForm& form = access.index[d];
    if (!moves(form, iterator)) continue;
    const bool is_regular = !is_moved_by_data(form, iterator) && form.modulus == 0;
    const double step = std::abs(step_of(form, iterator)) * points(inner, iterator);
    result.spatial = result.spatial && is_regular && d == 0 && step < double(line.elements);
    result.overlap = result.overlap && is_regular && step < double(box[d]);
  }
  return result;
}

LaneForm lane_form(const Access& access, int iterator, int lanes, const SizeModel& sizes,
                   LineSize line) {
  LaneForm result;
  if ((access.moved_by() & set_of(iterator)) == 0) {
    result.kind = LaneForm::Kind::Uniform;
    return result;
  }
  double stride = 0, row = 1;
  bool is_regular = true;
  for (size_t d = 0; d < access.index.size(); ++d) {
    const IndexForm& form = access.index[d];
    if (moves(form, iterator)) {
      is_regular = is_regular && !is_moved_by_data(form, iterator) && form.modulus == 0 &&
                   form.coefficient(iterator) % form.divisor == 0;
      stride += step_of(form, iterator) * row;
    }
    row *= double(std::max<int64_t>(sizes.of(access, d).estimate, 1));
  }
  const double reach = std::abs(stride) * (lanes - 1) + 1;
  const bool has_data = std::ranges::any_of(
      access.index, [&](const IndexForm& form) { return is_moved_by_data(form, iterator); });
  result.lines =
      has_data ? lanes : std::min<double>(lanes, std::ceil(reach / double(line.elements)));
  if (!is_regular) return result;
  result.kind = stride == 1    ? LaneForm::Kind::Contiguous
                : stride == -1 ? LaneForm::Kind::Reversed
                : stride == 0  ? LaneForm::Kind::Uniform
                               : LaneForm::Kind::Strided;
  if (result.kind == LaneForm::Kind::Strided) result.stride = stride;
  return result;
}

}  // namespace retrograde::planning
