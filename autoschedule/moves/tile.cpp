// tile -- a larger step of one or two iterators outside of the others, or a tile of another size.
//
//   parallel y, x:16, vector x     =>     parallel y:8, y, x:16, vector x             strips of rows
//                                  =>     parallel y:8, x:64, y, x:16, vector x       tiles
//   r.t, x:16, vector x            =>     x:256, r.t, x:16, vector x                  columns, over a whole reduction
//   y:8, y, x:16, vector x         =>     y:16, y, x:16, vector x and y:4, y, x:16, vector x
//   parallel c, y, x:16, vector x  =>     parallel c:16, y, x:16, c, vector x         lines along c, if c is innermost in
//                                                                                    memory of what is read across lanes
//
// Legal: L1: iterations of pure loops never meet, and steps of a reduction keep the order of those that do.
// L4, L9, L11: a step that changes does so in all stages that share it, and what is computed inside runs at any size.
// Sizes are powers of two; the first ones fill the first or the second cache with what the stage accesses.
#include <algorithm>
#include <bit>
#include <cmath>

#include "autoschedule/moves/edit.h"

namespace retrograde::planning::moves {

namespace {

int64_t power_of_two_below(double size) {
  return size < 1 ? 1 : static_cast<int64_t>(std::bit_floor(static_cast<uint64_t>(size)));
}

// The iterators that move the innermost dimension in memory of what is read across the lanes.
IteratorSet iterators_across(const StageLoops& loops, IteratorSet lanes) {
  IteratorSet found = 0;
  const auto note = [&](const Access& read, const MovedIndices& moved) {
    const auto moves_lanes = [&](IteratorSet set) { return (set & lanes) != 0; };
    if (read.of == loops.stage.func || std::ranges::none_of(moved, moves_lanes)) return;
    const auto first =
        read.of < 0 ? 0 : static_cast<size_t>(loops.plan.of(read.of).storage.order[0]);
    if (!moves_lanes(moved[first])) found |= moved[first];
  };
  for_each_read(loops.plan, loops.context, loops.stage, note);
  return found;
}

class Tiler {
 public:
  explicit Tiler(const StageLoops& loops) : loops_(loops), nest_(loops.nest) {
    const size_t body = body_depth(nest_);
    for (size_t d = body; d-- > 0;) {
      const int16_t i = nest_.loops[d].iterator;
      if (!is_free(loops_.context, loops_.stage, i)) continue;
      if (std::ranges::find(inner_, i, &Inner::iterator) == inner_.end()) inner_.push_back({i, d});
    }
  }

  std::vector<Nest> run() {
    if (inner_.empty()) return {};
    for (const size_t level : {size_t{0}, Machine::near_cache}) {
      const double points = loops_.context.machine.levels[level].bytes / bytes_of_point();
      if (inner_.size() > 1) {
        const auto row = static_cast<double>(points_of(inner_[0]));
        tile({{inner_[1], power_of_two_below(points / row)}}, inner_[1].depth);
        const int64_t side = power_of_two_below(std::sqrt(points));
        tile({{inner_[1], side}, {inner_[0], side}}, std::min(inner_[0].depth, inner_[1].depth));
      }
      size_t outside = shared_loops(loops_.plan, loops_.stage);
      while (outside < inner_[0].depth && nest_.loops[outside].kind == ForType::Parallel) ++outside;
      const bool is_in_reduction =
          outside < inner_[0].depth &&
          is_reduction(loops_.context, loops_.stage, nest_.loops[inner_[0].depth - 1].iterator);
      if (is_in_reduction) tile({{inner_[0], power_of_two_below(points)}}, outside);
    }
    if (const auto lanes = vector_loop(nest_)) {
      const IteratorSet across = iterators_across(loops_, set_of(nest_.loops[*lanes].iterator));
      for (const Inner& inner : inner_) {
        if (across & set_of(inner.iterator)) tile_across(inner);
      }
    }
    return std::move(nests_);
  }

 private:
  struct Inner {  // the innermost loop of an iterator around the body
    int16_t iterator;
    size_t depth;
  };
  struct Side {
    Inner inner;
    int64_t size;
  };
  const StageLoops& loops_;
  const Nest& nest_;
  std::vector<Nest> nests_;
  std::vector<Inner> inner_;  // innermost first

  int64_t points_of(const Inner& inner) const {
    return points_inside(loops_.extents, nest_, static_cast<int>(inner.depth) - 1, inner.iterator);
  }
  double bytes_of_point() const {
    const StageNode& node = loops_.context.accesses.stage(loops_.stage);
    double bytes = bytes_of_element(loops_.context, node.write);
    for (const Access& read : node.reads) bytes += bytes_of_element(loops_.context, read);
    return bytes;
  }

  // The new loops stand at `depth`.
  void tile(const std::vector<Side>& sides, size_t depth) {
    Nest nest = nest_;
    for (const auto& [inner, size] : sides) {
      const Loop& loop = nest_.loops[inner.depth];
      if (size <= loop.step || 2 * size > points_of(inner)) return;
    }
    for (size_t i = sides.size(); i-- > 0;) {
      const auto& [inner, size] = sides[i];
      Loop& loop = nest.loops[*find_loop(nest, inner.iterator, nest_.loops[inner.depth].step)];
      const ForType kind = loop.kind;
      loop.kind = ForType::Serial;
      insert_step(nest, inner.iterator, size, depth, kind);
    }
    if (!has_same_order(nest_, nest, loops_.extents)) nests_.push_back(std::move(nest));
  }

  // Runs the points of a cache line inside of all loops around the body.
  void tile_across(const Inner& inner) {
    const Loop loop = nest_.loops[inner.depth];
    const int64_t points = points_of(inner), size = std::min(line_elements, points);
    if (loop.step != 1 || inner.depth + 1 == body_depth(nest_) || !fits(size, points) ||
        inner.depth < shared_loops(loops_.plan, loops_.stage))
      return;
    Nest nest = nest_;
    nest.loops.erase(nest.loops.begin() + static_cast<std::ptrdiff_t>(inner.depth));
    insert_step(nest, inner.iterator, 1, body_depth(nest));
    if (size < points) insert_step(nest, inner.iterator, size, inner.depth, loop.kind);
    nests_.push_back(std::move(nest));
  }
};

std::vector<Nest> tiles(const StageLoops& loops) { return Tiler(loops).run(); }

// Doubles and halves the steps between others, also of loops that stages share.
void add_resized(std::vector<Plan>& plans, const StageLoops& loops) {
  const auto& [plan, context, stage, nest, extents] = loops;
  for (size_t d = body_depth(nest); d-- > 0;) {
    const auto [iterator, step] = std::pair(nest.loops[d].iterator, nest.loops[d].step);
    const auto is_inside = [&](const Loop& loop) {
      return loop.iterator == iterator && loop.step < step;
    };
    const auto inner = std::ranges::find_if(nest.loops, is_inside);
    const size_t body = body_depth(nest);
    if (!is_free(context, stage, iterator) || inner == nest.loops.end() ||
        inner - nest.loops.begin() >= static_cast<std::ptrdiff_t>(body))
      continue;
    const int64_t larger = outer_step(nest, iterator, step);
    const int64_t limit = larger > 0 ? larger : extents[static_cast<size_t>(iterator)];
    for (const int64_t size : {2 * step, (step + 1) / 2}) {
      if (size <= inner->step || size % inner->step != 0 || 2 * size > limit) continue;
      add(plans, with_step(plan, {stage, static_cast<int16_t>(d)}, size, context));
    }
  }
}

}  // namespace

std::vector<Plan> tile(const Plan& plan, FuncId func, const Context& context) {
  std::vector<Plan> plans = with_nests(plan, func, context, tiles);
  if (!has_loops(plan, func)) return plans;
  for (const StageNode& node : context.accesses.func(func).stages)
    add_resized(plans,
                {plan, context, node.id, plan.nest(node.id), loop_extents(plan, context, node.id)});
  return plans;
}

}  // namespace retrograde::planning::moves
