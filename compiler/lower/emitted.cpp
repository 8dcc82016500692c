#include "lower/emitted.h"

#include "ir/build.h"
#include "simplify/simplify.h"

namespace retrograde::ir {

void map_boxes(Emitted& code, const std::function<Box(const Box&)>& map) {
  for (auto& [name, use] : code.uses) use.box = map(use.box);
  for (auto& [name, box] : code.storage) box = map(box);
}

Box ranged_over(const std::vector<Loop>& loops, Box box) {
  if (loops.empty()) return box;
  Scope<Interval> ranges;
  for (const Loop& loop : loops) ranges.push(loop.name, loop.range());
  for (Interval& side : box) {
    if (side.min.defined()) side.min = bounds_of(side.min, ranges).min;
    if (side.max.defined()) side.max = bounds_of(side.max, ranges).max;
  }
  return box;
}

void range_over_loops(Emitted& code) {
  if (code.unranged.empty()) return;
  map_boxes(code, [&](const Box& box) { return ranged_over(code.unranged, box); });
  code.unranged.clear();
}

Box simplified(Box box) {
  for (Interval& side : box) {
    if (side.min.defined()) side.min = simplify(side.min);
    if (side.max.defined()) side.max = simplify(side.max);
  }
  return box;
}

namespace {

void merge_storage(std::map<std::string, Box>& into, const std::map<std::string, Box>& from) {
  for (const auto& [name, box] : from) into[name] = hull(into[name], box);
}

}  // namespace

void merge_code(Emitted& into, const Emitted& from) {
  merge_footprints(into.uses, from.uses);
  merge_storage(into.storage, from.storage);
  into.has_loops |= from.has_loops;
  into.has_vectors |= from.has_vectors;
}

void wrap(const Loop& loop, Emitted& code) {
  Expr min = code.lead > 0 ? simplify(loop.min - code.lead) : loop.min;
  Expr extent = code.lead > 0 ? simplify(loop.extent + code.lead) : loop.extent;
  code.stmt = make_for(loop.name, min, extent, loop.for_type, code.stmt, loop.partition);
  code.lead = 0;
  code.unranged.push_back(loop);
  code.has_loops |= loop.for_type == ForType::Parallel ||
                    (loop.for_type == ForType::Serial && !is_one(loop.extent));
  code.has_vectors |= loop.for_type == ForType::Vectorized;
}

}  // namespace retrograde::ir
