// register_tile -- the sums of a few elements of one or two dimensions and a few vectors of another stay in registers while
// the reduction runs, so that what it loads is used several times.
//
//   c, y, x:16, r.y, r.x, vector x     =>     c:4, y, x:32, r.y, r.x, unroll c, unroll x:16, vector x
//                                      =>     y, x:32, c:4, r.y, r.x, unroll c, unroll x:16, vector x
//   j, i, l:16, r, vector l            =>     j:4, i:4, l:16, r, unroll j, unroll i, vector l
//
// Operands that lanes would read across rows are stored along the lanes in further plans. Where lanes along another
// dimension load less, the Func and those that read it at their own places are stored along that dimension.
// Legal: L1, since iterations of pure loops never meet; L2, since loops of the reduction keep their order; L4, since each
// unrolled loop and the lanes have a step outside; L5.
// Method: the cycles of one term of a register, after what takes longest: loads, of which the operand of a side is shared
// by the other side; products; or the latency of a sum. A tile that exceeds a dimension wastes what lies beyond the end.
// Tiles are few, so all of them are tried, and the best ones are given.
#include <algorithm>
#include <array>
#include <cmath>
#include <compare>

#include "autoschedule/cost/assumptions.h"
#include "autoschedule/moves/edit.h"

namespace retrograde::planning::moves {

namespace {

constexpr int64_t most_vectors = 4, most_of_side = 8;
constexpr size_t most_tiles = 3;

class RegisterTiles {
 public:
  explicit RegisterTiles(const StageLoops& loops)
      : loops_(loops),
        context_(loops.context),
        stage_(loops.stage),
        node_(context_.accesses.stage(stage_)) {}

  bool find() {
    const std::optional<Nest> plain = without_body(loops_.nest, context_, stage_);
    const auto row = std::ranges::find(
        node_.iterators, loops_.plan.of(stage_.func).storage.order[0], &Iterator::dimension);
    if (!is_sum() || !plain || row == node_.iterators.end()) return false;
    plain_ = *plain;
    x_ = static_cast<int>(row - node_.iterators.begin());
    lanes_ = lanes_for(loops_.plan, stage_, points_of(plain_, x_));
    for (const Type& type : context_.accesses.func(stage_.func).func->types)
      bytes_ += type.bytes() * lanes_;
    row_loads_ = ir::mapped(node_.reads, [&](const Access& read) { return row_loads(read); });
    if (lanes_ > 1) find_tiles();
    std::ranges::sort(tiles_);
    return true;
  }
  // One term of an element takes so many cycles in the best tile; infinitely many if there is none.
  double cycles() const {
    return tiles_.empty() ? INFINITY : tiles_[0].cycles / static_cast<double>(lanes_);
  }
  // Each tile comes with operands as they are stored and, where they lie across the lanes, along these.
  void add_plans(std::vector<Plan>& plans) const {
    std::vector<Nest> nests;
    size_t given = 0;
    for (const Tile& tile : tiles_) {
      const std::optional<Nest> nest = given < most_tiles ? tiled(tile) : std::nullopt;
      if (!nest) continue;
      ++given;
      nests.push_back(*nest);
      if (const auto other = with_sides_inside(*nest, tile)) nests.push_back(*other);
    }
    for (Nest& nest : nests) {
      FuncPlan changed = loops_.plan.of(stage_.func);
      changed.nests[static_cast<size_t>(stage_.stage)] = std::move(nest);
      const auto tiled = with_func(loops_.plan, stage_.func, std::move(changed), context_);
      add(plans, tiled);
      if (tiled) add(plans, with_turned_operands(*tiled, stage_, context_));
    }
  }

 private:
  struct Side {  // copies along a dimension beside the lanes; none if the size is 1
    int iterator = -1;
    int64_t size = 1;
    auto operator<=>(const Side&) const = default;
  };
  struct Tile {
    double cycles;
    int64_t sums, vectors;
    std::array<Side, 2> sides;  // innermost last
    auto operator<=>(const Tile&) const = default;
  };
  const StageLoops& loops_;
  const Context& context_;
  const StageId stage_;
  const StageNode& node_;
  Nest plain_;  // without a body
  int x_ = 0;
  int64_t lanes_ = 1, bytes_ = 0;  // of a vector
  std::vector<double> row_loads_;  // by read
  std::vector<Tile> tiles_;

  // Whether the stage adds terms to elements that no loop of the reduction moves, and reads no others of its own.
  bool is_sum() const {
    bool reduces = false;
    for (int i = 0; i < static_cast<int>(node_.iterators.size()); ++i) {
      if (!is_reduction(context_, stage_, i)) continue;
      reduces = true;
      if (node_.write.moved_by() & set_of(i)) return false;
    }
    return reduces && stage_.stage > 0 && std::ranges::all_of(node_.reads, [&](const Access& read) {
             return read.of != stage_.func || read.index == node_.write.index;
           });
  }
  int64_t points_of(const Nest& nest, int iterator) const {
    const auto depth = static_cast<int>(innermost_loop(nest, iterator));
    return points_inside(loops_.extents, nest, depth - 1, iterator);
  }

  // A second side only where it is faster than one.
  void find_tiles() {
    std::vector<Side> sides;
    for (int i = 0; i < static_cast<int>(node_.iterators.size()); ++i) {
      if (i == x_ || !is_free(context_, stage_, i)) continue;
      const int64_t points = points_of(plain_, i);
      for (int64_t size = 2; size <= std::min(most_of_side, points); ++size) {
        const bool is_even = size == points || (size & (size - 1)) == 0;
        if (is_even && fits(size, points)) sides.push_back({i, size});
      }
    }
    for (const Side& side : sides) add_tiles({Side{}, side});
    const auto fastest = std::ranges::min_element(tiles_);
    const double limit = fastest == tiles_.end() ? INFINITY : fastest->cycles;
    for (const Side& outer : sides) {
      for (const Side& inner : sides)
        if (outer.iterator > inner.iterator) add_tiles({outer, inner}, limit);
    }
  }
  void add_tiles(const std::array<Side, 2>& sides, double limit = INFINITY) {
    const int64_t row = points_of(plain_, x_);
    for (int64_t vectors = 1; vectors <= most_vectors; vectors *= 2) {
      const int64_t sums = vectors * sides[0].size * sides[1].size;
      if (!fits(vectors * lanes_, row) || sums * bytes_ > context_.machine.accumulator_bytes())
        continue;
      double waste = lost(row, vectors * lanes_);
      for (const Side& side : sides)
        if (side.size > 1) waste *= lost(points_of(plain_, side.iterator), side.size);
      const double all = cycles(vectors, sides) * waste;
      if (all < limit) tiles_.push_back({all, sums, vectors, sides});
    }
  }
  static double lost(int64_t points, int64_t size) {
    const int64_t all = (points + size - 1) / size * size;
    return static_cast<double>(all) / static_cast<double>(points);
  }

  // Loads of a register that lanes read; 0: all lanes read one element.
  double row_loads(const Access& read) const {
    if ((read.moved_by() & set_of(x_)) == 0) return 0;
    const int64_t stride = lane_stride(loops_.plan, context_, read, x_);
    const double by_lane = core.gather_lane_operations * static_cast<double>(lanes_);
    return stride == 0 ? by_lane
                       : std::min(by_lane, core.unaligned_loads * static_cast<double>(stride));
  }
  // The cycles of one term in a register.
  double cycles(int64_t vectors, const std::array<Side, 2>& sides) const {
    const double registers =
        std::max(1.0, static_cast<double>(bytes_) / context_.machine.vector_bytes);
    const double sums = registers * static_cast<double>(vectors * sides[0].size * sides[1].size);
    double loads = 0;
    for (size_t r = 0; r < node_.reads.size(); ++r) {
      const Access& read = node_.reads[r];
      if (read.of == stage_.func) continue;
      const bool is_row = read.moved_by() & set_of(x_);
      double count = is_row ? row_loads_[r] * registers * static_cast<double>(vectors) : 1;
      for (const Side& side : sides)
        if (side.size > 1 && (read.moved_by() & set_of(side.iterator)))
          count *= static_cast<double>(side.size);
      loads += count;
    }
    const double loading = loads / sums / core.loads_per_cycle,
                 adding = 1 / core.products_per_cycle;
    return std::max({loading + not_overlapped * adding, adding + not_overlapped * loading,
                     core.float_latency / sums});
  }

  std::optional<Nest> tiled(const Tile& tile) const {
    Nest nest = plain_;
    const auto is_sum_loop = [&](const Loop& loop) {
      return is_reduction(context_, stage_, loop.iterator);
    };
    std::ranges::stable_partition(nest.loops, [&](const Loop& l) { return !is_sum_loop(l); });
    for (const Side& side : tile.sides) {
      if (side.size == 1) continue;
      if (side.size > points_of(nest, side.iterator)) return std::nullopt;
      run_inside(nest, side.iterator, side.size, ForType::Unrolled);
    }
    if (tile.vectors > 1) {
      const int64_t larger = outer_step(nest, x_, 1);
      if (larger > 0 && larger <= tile.vectors * lanes_) return std::nullopt;
      nest.loops[innermost_loop(nest, x_)].step = tile.vectors * lanes_;
      insert_step(nest, x_, lanes_, nest.loops.size(), ForType::Unrolled);
      insert_step(nest, x_, 1, nest.loops.size(), ForType::Vectorized);
    } else {
      run_inside(nest, x_, lanes_, ForType::Vectorized);
    }
    if (operations(loops_.plan, context_, stage_) * tile.sums > most_body_operations)
      return std::nullopt;
    return nest;
  }

  // The loops over the sides inside of those along rows, so that a few rows of operands serve all of them.
  std::optional<Nest> with_sides_inside(const Nest& nest, const Tile& tile) const {
    Nest inside = nest;
    const auto is_outside = [&](const Loop& loop) {
      return loop.iterator != tile.sides[0].iterator && loop.iterator != tile.sides[1].iterator;
    };
    const auto pure_end = std::ranges::find_if(inside.loops, [&](const Loop& loop) {
      return is_reduction(context_, stage_, loop.iterator);
    });
    std::stable_partition(inside.loops.begin(), pure_end, is_outside);
    if (has_same_order(nest, inside, loops_.extents)) return std::nullopt;
    const auto is_parallel = [](const Loop& loop) { return loop.kind == ForType::Parallel; };
    const bool was_parallel = std::ranges::any_of(inside.loops, is_parallel);
    for (Loop& loop : inside.loops)
      if (is_parallel(loop)) loop.kind = ForType::Serial;
    if (was_parallel) run_in_parallel(inside, context_, stage_);
    return inside;
  }
};

// Tiles of the stage, and of the same with lanes along the dimension in which they take the fewest cycles.
void add_tiles_of(const Plan& plan, StageId stage, const Context& context,
                  std::vector<Plan>& plans) {
  const auto loops_in = [&](const Plan& other) {
    return StageLoops{other, context, stage, other.nest(stage),
                      loop_extents(other, context, stage)};
  };
  const StageLoops loops = loops_in(plan);
  RegisterTiles straight(loops);
  if (!straight.find()) return;
  straight.add_plans(plans);
  double fewest = straight.cycles();
  std::vector<Plan> best;
  const int dimensions = context.accesses.func(stage.func).func->dimensions();
  for (int d = 0; d < dimensions; ++d) {
    if (plan.of(stage.func).storage.order[0] == d) continue;
    const std::optional<Plan> turned = with_turned_results(plan, stage.func, d, context);
    if (!turned) continue;
    const StageLoops along = loops_in(*turned);
    RegisterTiles tiles(along);
    if (!tiles.find() || tiles.cycles() >= fewest) continue;
    fewest = tiles.cycles();
    best.clear();
    tiles.add_plans(best);
  }
  for (Plan& found : best) add(plans, std::move(found));
}

}  // namespace

std::vector<Plan> register_tile(const Plan& plan, FuncId func, const Context& context) {
  std::vector<Plan> plans;
  const FuncNode& node = context.accesses.func(func);
  if (!has_loops(plan, func) || node.func->dimensions() < 2) return plans;
  for (const StageNode& stage : node.stages) add_tiles_of(plan, stage.id, context, plans);
  return plans;
}

}  // namespace retrograde::planning::moves
