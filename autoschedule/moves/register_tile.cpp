// register_tile -- the sums of a few elements of one dimension and a few vectors of another stay in registers while the
// reduction runs, so that what it loads is used several times.
//
//   c, y, x:16, r.y, r.x, vector x     =>     c:4, y, x:32, r.y, r.x, unroll c, unroll x:16, vector x
//
// Legal: L1, since iterations of pure loops never meet; L2, since loops of the reduction keep their order; L4, since each
// unrolled loop and the lanes have a step outside; L5.
// Method: the cycles of one term of a register, after what takes longest: loads, of which the operand of a side is shared
// by the other side; products; or the latency of a sum. A tile that exceeds a dimension wastes what lies beyond the end.
// Tiles are few, so all of them are tried, and the best ones are given.
#include <algorithm>
#include <compare>

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

  std::vector<Nest> run() {
    if (!is_sum()) return {};
    const std::optional<Nest> plain = without_body(loops_.nest, context_, stage_);
    const auto row = std::ranges::find(
        node_.iterators, loops_.plan.of(stage_.func).storage.order[0], &Iterator::dimension);
    if (!plain || row == node_.iterators.end()) return {};
    x_ = static_cast<int>(row - node_.iterators.begin());
    lanes_ = lanes_for(loops_.plan, stage_, points_of(*plain, x_));
    if (lanes_ > 1) find_tiles(*plain);
    std::ranges::sort(tiles_);
    std::vector<Nest> nests;
    for (const Tile& tile : tiles_) {
      if (nests.size() < most_tiles) give(*plain, tile, nests);
    }
    return nests;
  }

 private:
  struct Tile {
    double cycles;
    int64_t sums, vectors, size;
    int side;
    auto operator<=>(const Tile&) const = default;
  };
  const StageLoops& loops_;
  const Context& context_;
  const StageId stage_;
  const StageNode& node_;
  int x_ = 0;
  int64_t lanes_ = 1;
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

  void find_tiles(const Nest& plain) {
    const auto& types = context_.accesses.func(stage_.func).func->types;
    int64_t bytes = 0;
    for (const Type& type : types) bytes += type.bytes() * lanes_;
    const int64_t row = points_of(plain, x_);
    for (int i = 0; i < static_cast<int>(node_.iterators.size()); ++i) {
      if (i == x_ || !is_free(context_, stage_, i)) continue;
      const int64_t points = points_of(plain, i);
      for (int64_t vectors = 1; vectors <= most_vectors; vectors *= 2) {
        if (!fits(vectors * lanes_, row)) continue;
        for (int64_t size = 2; size <= std::min(most_of_side, points); ++size) {
          const int64_t sums = vectors * size;
          const bool is_even = size == points || (size & (size - 1)) == 0;
          if (!is_even || !fits(size, points) ||
              sums * bytes > context_.machine.accumulator_bytes())
            continue;
          const double waste = lost(points, size) * lost(row, vectors * lanes_);
          tiles_.push_back({cycles(vectors, size, i, bytes) * waste, sums, vectors, size, i});
        }
      }
    }
  }
  static double lost(int64_t points, int64_t size) {
    const int64_t all = (points + size - 1) / size * size;
    return static_cast<double>(all) / static_cast<double>(points);
  }

  // The cycles of one term in a register.
  double cycles(int64_t vectors, int64_t size, int side, int64_t bytes) const {
    const double registers =
        std::max(1.0, static_cast<double>(bytes) / context_.machine.vector_bytes);
    const double sums = registers * static_cast<double>(vectors * size);
    double loads = 0;
    for (const Access& read : node_.reads) {
      if (read.of == stage_.func) continue;
      const bool is_row = read.moved_by() & set_of(x_);
      double count = is_row ? core.unaligned_loads * registers * static_cast<double>(vectors) : 1;
      if (read.moved_by() & set_of(side)) count *= static_cast<double>(size);
      loads += count;
    }
    return std::max({loads / sums / core.loads_per_cycle, 1 / core.products_per_cycle,
                     core.float_latency / sums});
  }

  void give(const Nest& plain, const Tile& tile, std::vector<Nest>& nests) const {
    Nest nest = plain;
    const auto is_sum_loop = [&](const Loop& loop) {
      return is_reduction(context_, stage_, loop.iterator);
    };
    std::ranges::stable_partition(nest.loops, [&](const Loop& l) { return !is_sum_loop(l); });
    if (tile.size > points_of(nest, tile.side)) return;
    run_inside(nest, tile.side, tile.size, ForType::Unrolled);
    if (tile.vectors > 1) {
      const int64_t larger = outer_step(nest, x_, 1);
      if (larger > 0 && larger <= tile.vectors * lanes_) return;
      nest.loops[innermost_loop(nest, x_)].step = tile.vectors * lanes_;
      insert_step(nest, x_, lanes_, nest.loops.size(), ForType::Unrolled);
      insert_step(nest, x_, 1, nest.loops.size(), ForType::Vectorized);
    } else {
      run_inside(nest, x_, lanes_, ForType::Vectorized);
    }
    if (operations(loops_.plan, context_, stage_) * tile.sums <= most_body_operations)
      nests.push_back(std::move(nest));
  }
};

std::vector<Nest> tiles_of_sums(const StageLoops& loops) { return RegisterTiles(loops).run(); }

}  // namespace

std::vector<Plan> register_tile(const Plan& plan, FuncId func, const Context& context) {
  if (context.accesses.func(func).func->dimensions() < 2) return {};
  return with_nests(plan, func, context, tiles_of_sums);
}

}  // namespace retrograde::planning::moves
