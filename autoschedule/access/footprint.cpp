#include "autoschedule/access/footprint.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace retrograde::planning {

namespace {

double source_extent(const Access& access, size_t dimension, const SizeModel& sizes) {
  const Extent extent =
      access.of >= 0 ? sizes.of(access.of, dimension) : sizes.of_image(access.image, dimension);
  return static_cast<double>(std::max<int64_t>(extent.estimate, 1));
}

double trips(StageId stage, int iterator, const SizeModel& sizes) {
  return static_cast<double>(std::max<int64_t>(sizes.of(stage, iterator).estimate, 1));
}

double trips(const Value& value, IteratorSet loops, StageId stage, const SizeModel& sizes) {
  double result = 1;
  for (const int16_t i : value.iterators)
    if (loops & set_of(i)) result *= trips(stage, i, sizes);
  return result;
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

Window window_of(const IndexForm& form, IteratorSet loops, StageId stage, double extent,
                 const SizeModel& sizes) {
  Window window;
  window.points = window.reach = static_cast<double>(form.high - form.low + 1);
  std::vector<Term> terms =
      ir::filtered(form.terms, [&](const Term& t) { return (loops & set_of(t.iterator)) != 0; });
  std::ranges::sort(terms, {}, [](const Term& t) { return std::abs(t.coefficient); });
  for (const Term& term : terms)
    add_loop(window, static_cast<double>(std::abs(term.coefficient)),
             trips(stage, term.iterator, sizes));
  for (const OpaqueTerm& term : form.opaque) {
    if ((loops & term.value.depends()) == 0) continue;
    const ir::ConstantRange range = sizes.range(term.range);
    const double values = range.is_bounded() ? static_cast<double>(range.extent())
                                             : std::numeric_limits<double>::infinity();
    const double taken = std::min(values, trips(term.value, loops, stage, sizes));
    window.points *= taken;
    window.reach += static_cast<double>(std::abs(term.coefficient)) * (values - 1);
  }
  window.reach = std::floor((window.reach - 1) / static_cast<double>(form.divisor)) + 1;
  if (form.modulus != 0) window.reach = std::min(window.reach, static_cast<double>(form.modulus));
  const ir::ConstantRange within = sizes.range(form.within);
  if (within.is_bounded()) extent = std::min(extent, static_cast<double>(within.extent()));
  window.reach = std::min(window.reach, extent);
  window.points = std::min(window.points, window.reach);
  return window;
}

// At most one element for each iteration and tap.
double iterations_of(const Access& access, IteratorSet loops, const SizeModel& sizes) {
  double result = 1;
  for (int i = 0; i < 32; ++i) {
    const IteratorSet loop = IteratorSet{1} << i;
    if (loops & access.moved_by() & loop) result *= trips(access.by, i, sizes);
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

Footprint footprint(const Access& access, IteratorSet loops, const SizeModel& sizes,
                    LineSize line) {
  const auto in_line = static_cast<double>(line.elements);
  Footprint result;
  double run = 1;        // elements that lie together
  bool is_whole = true;  // all dimensions so far are touched from end to end
  for (size_t d = 0; d < access.index.size(); ++d) {
    const double extent = source_extent(access, d, sizes);
    const Window window = window_of(access.index[d], loops, access.by, extent, sizes);
    result.elements *= window.points;
    if (d == 0)
      result.lines = std::min(window.points, std::ceil(window.reach / in_line));
    else
      result.lines *= window.points;
    if (is_whole && window.is_dense()) {
      run *= window.points;
      result.lines = std::min(result.lines, std::ceil(run / in_line));
    }
    is_whole = is_whole && window.points >= extent;
  }
  result.elements = std::min(result.elements, iterations_of(access, loops, sizes));
  result.lines = std::min(result.lines, result.elements);
  return result;
}

Reuse reuse(const Access& access, int iterator, IteratorSet inner, const SizeModel& sizes,
            LineSize line) {
  Reuse result;
  result.temporal = (access.moved_by() & set_of(iterator)) == 0;
  if (result.temporal) return result;
  result.spatial = result.overlap = true;
  for (size_t d = 0; d < access.index.size(); ++d) {
    const IndexForm& form = access.index[d];
    if (!moves(form, iterator)) continue;
    const bool is_regular = !is_moved_by_data(form, iterator) && form.modulus == 0;
    const double step = std::abs(step_of(form, iterator));
    const double extent = source_extent(access, d, sizes);
    const Window window = window_of(form, inner & ~set_of(iterator), access.by, extent, sizes);
    result.spatial = result.spatial && is_regular && d == 0 && step < double(line.elements);
    result.overlap = result.overlap && is_regular && step < window.reach;
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
    row *= source_extent(access, d, sizes);
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
