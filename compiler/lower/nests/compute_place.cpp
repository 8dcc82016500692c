#include "lower/nests/compute_place.h"

#include <algorithm>

#include "ir/build.h"
#include "simplify/simplify.h"

namespace retrograde::lower {

Expr ComputePlace::name(const std::string& name, const Expr& value, bool always) {
  if (!always && (is_const(value) || value.as<Variable>())) return value;
  bindings.emplace_back(name, value);
  return variable(name);
}

Range ComputePlace::bind(const std::string& name, Interval& range) {
  Expr extent = simplify(range.max - range.min + 1);
  range.min = this->name(name + ".min", simplify(range.min), false);
  if (is_const(extent)) {
    range.max = simplify(range.min + extent - 1);
  } else {
    range.max = this->name(name + ".max", simplify(range.max), false);
    extent = simplify(range.max - range.min + 1);
  }
  return {range.min, extent};
}

namespace {

// The range of an end within one iteration: a single point if the part has no choice between iterations.
Interval end_of_part(const Expr& end, const Expr& touched_end, const Interval& touched) {
  return end.same_as(touched_end) ? Interval::point(end) : touched;
}

}  // namespace

Range ComputePlace::bind_part(const std::string& name, const Slide& slide, Interval& range) {
  const auto& [part, touched] = std::pair(slide.part, slide.touched);
  Expr extent = simplify(part.max - part.min + 1);
  Interval whole = slide.whole;
  range.min = this->name(name + ".min", part.min, true);
  if (is_const(extent)) {
    range.max = simplify(range.min + extent - 1);
    whole.max = simplify(whole.max - extent + 1);
    const Interval first{touched.min, simplify(touched.max - extent + 1)};
    note_part(range.min, whole, end_of_part(part.min, touched.min, first));
  } else {
    range.max = this->name(name + ".max", part.max, true);
    extent = simplify(range.max - range.min + 1);
    for (const Expr& end : {range.min, range.max})
      varying_parts_.push_back(end.as<Variable>()->name);
    note_part(range.min, whole, end_of_part(part.min, touched.min, touched));
    note_part(range.max, whole, end_of_part(part.max, touched.max, touched));
  }
  return {range.min, extent};
}

void ComputePlace::note_part(const Expr& end, const Interval& whole, const Interval& touched) {
  const std::string& name = end.as<Variable>()->name;
  parts_.push_back(name);
  whole_.push(name, whole);
  touched_.push(name, touched);
}

bool ComputePlace::mentions_parts(const Interval& side) const {
  return std::ranges::any_of(varying_parts_, [&](const std::string& part) {
    return uses_variable(side.min, part) || uses_variable(side.max, part);
  });
}

void ComputePlace::learn_names() {
  for (; known_ < bindings.size(); known_++) {
    const auto& [name, value] = bindings[known_];
    if (!whole_.contains(name)) values_[name] = simplify(substitute(value, values_));
  }
}

Expr ComputePlace::without_names(const Expr& e) {
  learn_names();
  return simplify(substitute(e, values_));
}

Box ComputePlace::expand(const Box& box, const Scope<Interval>& parts) {
  learn_names();
  Box result = box;
  for (Interval& side : result) {
    for (Expr* end : {&side.min, &side.max}) {
      if (!end->defined()) continue;
      *end = simplify(substitute(*end, values_));
      if (parts_.empty()) continue;
      Interval range = bounds_of(*end, parts);
      *end = end == &side.min ? range.min : range.max;
      if (end->defined()) *end = simplify(*end);
    }
  }
  return result;
}

}  // namespace retrograde::lower
