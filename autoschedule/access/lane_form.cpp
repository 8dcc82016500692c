#include "autoschedule/access/lane_form.h"

#include <algorithm>
#include <cmath>

namespace retrograde::planning {

namespace {

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
    if ((form.moved_by() & set_of(iterator)) != 0) {
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
