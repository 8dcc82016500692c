#include "lower/nests/emitted.h"

#include "ir/build.h"
#include "ir/visit.h"
#include "lower/program.h"
#include "simplify/simplify.h"

namespace retrograde::lower {

void map_boxes(Needs& needs, const std::function<Box(const Box&)>& map) {
  for (auto& [name, use] : needs.uses) use.box = map(use.box);
  for (auto& [name, box] : needs.storage) box = map(box);
  for (auto& [name, box] : needs.touched) box = map(box);
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

void range_over_loops(Needs& needs) {
  if (needs.unranged.empty()) return;
  map_boxes(needs, [&](const Box& box) { return ranged_over(needs.unranged, box); });
  needs.unranged.clear();
}

Box simplified(Box box) {
  for (Interval& side : box) {
    if (side.min.defined()) side.min = simplify(side.min);
    if (side.max.defined()) side.max = simplify(side.max);
  }
  return box;
}

void Overrun::add(const Overrun& other) {
  leaves_domain |= other.leaves_domain;
  counts |= other.counts;
  inside.insert(inside.end(), other.inside.begin(), other.inside.end());
}

void merge_needs(Needs& into, const Needs& from) {
  into.overrun.add(from.overrun);
  merge_footprints(into.uses, from.uses);
  for (const auto& [name, box] : from.storage) into.storage[name] = hull(into.storage[name], box);
  for (const auto& [name, box] : from.touched) into.touched[name] = hull(into.touched[name], box);
}

void merge_code(Emitted& into, const Emitted& from) {
  merge_needs(into, from);
  into.has_loops |= from.has_loops;
  into.has_vectors |= from.has_vectors;
}

namespace {

// Promises from splits bound the coordinates of a loop's iterations, but not of those before the first (warm-up).
template <class Tree>
Tree without_promises_about(const std::string& loop, const Tree& tree) {
  return rewrite(tree, [&](const Expr& e, const auto& recurse) {
    const auto* promise = as_op(e, Op::promise_clamped);
    return promise && uses_variable(e, loop) ? recurse(promise->args[0]) : Expr();
  });
}

// Iterations before a loop's first need at most the region of the first, but a box that depends on the loop's variable
// may be larger there. Hoisted storage has room for each of them.
void make_room_for_early_iterations(const Loop& early, Emitted& code) {
  range_over_loops(code);
  for (auto& [name, box] : code.storage) {
    if (!is_place_name(name)) continue;
    for (Interval& side : box) {
      if (side.max.defined()) side.max = without_promises_about(early.name, side.max);
    }
    box = ranged_over({early}, box);
  }
}

}  // namespace

void wrap(const Loop& loop, Emitted& code) {
  Loop run = loop;
  if (code.lead > 0) {
    code.stmt = without_promises_about(loop.name, code.stmt);
    run.min = simplify(loop.min - code.lead);
    run.extent = simplify(loop.extent + code.lead);
    make_room_for_early_iterations(run, code);
  }
  code.stmt = make_for(loop.name, run.min, run.extent, loop.runs, code.stmt, loop.partition);
  code.lead = 0;
  code.unranged.push_back(loop);
  for (Strand& strand : code.strands) {
    strand.unranged.push_back(strand.loops.back());
    strand.loops.pop_back();
    strand.at.pop_back();
  }
  code.has_loops |=
      runs_at_once(loop.runs) || (loop.runs == ForType::Serial && !is_one(loop.extent));
  code.has_vectors |= loop.runs == ForType::Vectorized;
}

}  // namespace retrograde::lower
