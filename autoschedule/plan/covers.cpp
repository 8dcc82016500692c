#include "autoschedule/plan/covers.h"

#include <algorithm>

#include "autoschedule/plan/nest.h"
#include "autoschedule/plan/readers.h"
#include "ir/build.h"

namespace retrograde::planning {

namespace {

int64_t rounded_up_quotient(int64_t a, int64_t b) { return (a + b - 1) / b; }

// The points that the loops of a nest cover from a depth on.
class NestCover {
 public:
  // `whole`: what all loops cover. `iterators`: how many of these have loops; those of fusions are next.
  NestCover(const Nest& nest, const Cover& whole, size_t first, size_t iterators)
      : nest_(nest), whole_(whole), first_(first), iterators_(static_cast<int>(iterators)) {}

  // The last iterator has no loop if it numbers the points that one iteration updates.
  Cover points() const {
    Cover cover = whole_;
    for (int i = 0; i < iterators_; ++i) cover[static_cast<size_t>(i)] = points(i);
    return cover;
  }

 private:
  // The smallest step first.
  int64_t points(int iterator) const {
    const int64_t all = extent(iterator);
    int64_t result = 1;
    for (const Part* part = next_larger(nest_, iterator, 0); part;) {
      const Part* larger = next_larger(nest_, iterator, part->step);
      result = std::min(result * covered(*part), larger ? std::min(larger->step, all) : all);
      part = larger;
    }
    return result;
  }

  const Nest& nest_;
  const Cover& whole_;
  const size_t first_;
  const int iterators_;

  int64_t extent(int iterator) const {
    if (iterator < iterators_) return whole_[static_cast<size_t>(iterator)];
    const Fusion& fusion = nest_.fusions[static_cast<size_t>(iterator - iterators_)];
    return iterations(fusion.inner) * iterations(fusion.outer);
  }
  int64_t iterations(const Part& part) const {
    const Part* larger = next_larger(nest_, part.iterator, part.step);
    const int64_t all = extent(part.iterator);
    return rounded_up_quotient(larger ? std::min(larger->step, all) : all, part.step);
  }
  // The iterations of a part that the loops from the depth on run.
  int64_t covered(const Part& part) const {
    for (size_t d = 0; d < nest_.loops.size(); ++d) {
      if (&nest_.loops[d] == &part) return d < first_ ? 1 : iterations(part);
    }
    size_t f = 0;
    while (&nest_.fusions[f].inner != &part && &nest_.fusions[f].outer != &part) ++f;
    const int64_t all = points(iterators_ + static_cast<int>(f));
    const int64_t in_inner = std::min(all, iterations(nest_.fusions[f].inner));
    return &nest_.fusions[f].inner == &part ? in_inner : rounded_up_quotient(all, in_inner);
  }
};

ir::ConstantRange range_of(const std::vector<const Access*>& accesses, size_t dimension,
                           const SizeModel& sizes) {
  ir::ConstantRange all{INT64_MAX, INT64_MIN};
  for (const Access* access : accesses)
    all = hull(all, sizes.range(access->index[dimension], access->by));
  return all;
}

bool is_pure(const Iterator& iterator) { return iterator.kind == Iterator::Kind::Pure; }

// A box that holds those of several stages. As the loops around all of them go on, each box moves from one end of what
// its stage accesses in the whole program to the other one; at one of the ends they are furthest apart.
class GrowingBox {
 public:
  void add(const std::vector<const Access*>& accesses, const Cover& cover, const SizeModel& sizes) {
    const std::vector<int64_t> box = extents(accesses, cover, sizes);
    sides_.resize(box.size());
    for (size_t d = 0; d < box.size(); ++d)
      sides_[d].add(range_of(accesses, d, sizes), box[d], most_of(*accesses[0], d, sizes));
  }
  // Accesses of an update. Where its pure variables decide, they go on with the box; elsewhere they stand, and the box
  // reaches to them.
  void add_update(const std::vector<const Access*>& accesses, const Cover& cover,
                  const SizeModel& sizes) {
    const std::vector<int64_t> box = extents(accesses, cover, sizes);
    const auto& iterators = sizes.graph().stage(accesses[0]->by).iterators;
    for (size_t d = 0; d < box.size(); ++d) {
      sides_[d].length = std::max(sides_[d].length, box[d]);
      IteratorSet moves = 0;
      for (const Access* access : accesses) moves |= access->index[d].moved_by();
      bool goes_on = false;
      for (size_t i = 0; i < iterators.size(); ++i)
        goes_on |= is_pure(iterators[i]) && (moves & set_of(static_cast<int>(i)));
      const ir::ConstantRange all = range_of(accesses, d, sizes);
      if (!goes_on) sides_[d].hold(all, all, most_of(*accesses[0], d, sizes));
    }
  }
  std::vector<int64_t> extents_of_all() const { return ir::mapped(sides_, &Side::length); }

 private:
  struct Side {
    ir::ConstantRange first{INT64_MAX, INT64_MIN}, last = first;  // at the ends of the loops around
    int64_t length = 1;

    void add(const ir::ConstantRange& all, int64_t extent, int64_t most) {
      length = std::max(length, extent);
      if (all.is_bounded())
        hold({all.min, all.min + extent - 1}, {all.max - extent + 1, all.max}, most);
    }
    void hold(const ir::ConstantRange& at_first, const ir::ConstantRange& at_last, int64_t most) {
      if (!at_first.is_bounded()) return;
      first = hull(first, at_first);
      last = hull(last, at_last);
      length = std::min(std::max({length, first.extent(), last.extent()}), most);
    }
  };
  static int64_t most_of(const Access& access, size_t dimension, const SizeModel& sizes) {
    return std::max<int64_t>(sizes.of(access, dimension).estimate, 1);
  }
  std::vector<Side> sides_;
};

// A dimension with a bound is always computed from end to end, one with an alignment in multiples of it.
std::vector<int64_t> with_bounds(std::vector<int64_t> box, FuncId func, const SizeModel& sizes) {
  const graph::FuncContents& f = *sizes.graph().func(func).func;
  for (const graph::Bound& bound : f.schedule.bounds) {
    const auto d = static_cast<size_t>(std::ranges::find(f.args, bound.var) - f.args.begin());
    const auto multiple = as_const_int(bound.modulus);
    if (bound.extent.defined())
      box[d] = std::max(box[d], sizes.of(func, d).estimate);
    else if (multiple)
      box[d] = rounded_up_quotient(box[d], *multiple) * *multiple;
  }
  return box;
}

// The depth of the level's loop in a stage that shares it with the loop's own stage.
std::optional<int> shared_depth(const Plan& plan, StageId stage, const Level& level) {
  if (plan.of(stage.func).opacity != Opacity::None) return std::nullopt;
  const std::optional<LoopRef>& shared = plan.nest(stage).shared_with;
  const auto depth = shared ? depth_in(plan, shared->stage, level) : std::nullopt;
  return depth && *depth <= shared->depth ? depth : std::nullopt;
}

std::vector<const Access*> reads_of(const StageNode& stage, FuncId func) {
  std::vector<const Access*> result;
  for (const Access& read : stage.reads) {
    if (read.of == func) result.push_back(&read);
  }
  return result;
}

}  // namespace

Cover Covers::inside(StageId stage, int depth) {
  const Cover whole = all_of(stage);
  if (depth == around_all_loops || plan_.of(stage.func).opacity != Opacity::None) return whole;
  const bool has_points = point_number(sizes_.graph().func(stage.func).func->stage(stage.stage));
  const size_t iterators = whole.size() - (has_points ? 1 : 0);
  return NestCover(plan_.nest(stage), whole, static_cast<size_t>(depth) + 1, iterators).points();
}

std::vector<int64_t> Covers::box(FuncId func, const Level& level) {
  const Key key{func, level.loop.stage, level.loop.depth, level.in_each_stage};
  if (const auto* known = ir::find_or_null(boxes_, key)) return *known;
  const AccessGraph& graph = sizes_.graph();
  GrowingBox box;
  for (const StageId reader : graph.consumers(func))
    box.add(reads_of(graph.stage(reader), func), cover_in(reader, level), sizes_);
  // Earlier stages compute all that an update accesses.
  const std::vector<StageNode>& stages = graph.func(func).stages;
  for (size_t s = stages.size(); s-- > 1;) {
    std::vector<const Access*> accesses = reads_of(stages[s], func);
    accesses.push_back(&stages[s].write);
    box.add_update(accesses, cover_of_box(stages[s].id, box.extents_of_all(), sizes_), sizes_);
  }
  return boxes_.emplace(key, with_bounds(box.extents_of_all(), func, sizes_)).first->second;
}

Cover Covers::all_of(StageId stage) {
  const Level& compute = plan_.of(stage.func).placement.compute;
  if (compute.kind != Level::Kind::At) return whole_cover(stage, sizes_);
  return cover_of_box(stage, box(stage.func, compute), sizes_);
}

// The points of a stage in one iteration of a loop around it.
Cover Covers::cover_in(StageId stage, const Level& level) {
  if (const auto depth = depth_in(plan_, stage, level)) return inside(stage, *depth);
  if (const auto depth = shared_depth(plan_, stage, level)) return inside(stage, *depth);
  const Level::Kind kind = plan_.of(stage.func).placement.compute.kind;
  if (kind == Level::Kind::Root || sizes_.graph().func(stage.func).is_output)
    return whole_cover(stage, sizes_);
  return cover_of_box(stage, box(stage.func, level), sizes_);
}

}  // namespace retrograde::planning
