#include "autoschedule/start_in_tiles.h"

#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "autoschedule/new_loop.h"
#include "autoschedule/row_scans.h"
#include "frontend/schedule/stage.h"
#include "graph/definitions/own_reads.h"
#include "ir/build.h"

namespace retrograde::autoschedule {

namespace {

// nullopt: it is of the reduction, runs over lanes, or its dimension was cut in more than one place.
std::optional<TileLoop> tile_loop(const FuncContents& f, const Definition& stage, const Dim& loop) {
  const bool runs = loop.runs == ForType::Serial || loop.runs == ForType::Parallel;
  if (loop.is_reduction || !runs) return std::nullopt;
  TileLoop result{loop, loop.var, nullptr};
  for (const Split& made : stage.schedule.splits) {
    if (made.outer == loop.var || made.inner == loop.var) result.dimension = made.old_var;
  }
  int cuts = 0;
  for (const Split& made : stage.schedule.splits) {
    if (made.old_var != result.dimension && made.outer != result.dimension) continue;
    const bool is_plain = made.kind == Split::Kind::Split && made.outer == made.old_var &&
                          made.tail == TailStrategy::GuardWithIf;
    result.split = is_plain ? &made : nullptr;
    cuts += is_plain ? 1 : 2;
  }
  const auto arg = std::find(f.args.begin(), f.args.end(), result.dimension);
  const bool is_pure =
      arg != f.args.end() && is_pure_position(f, stage, static_cast<size_t>(arg - f.args.begin()));
  return is_pure && cuts <= 1 ? std::optional(result) : std::nullopt;
}

bool has_reduction_inside(const Definition& stage, size_t shared) {
  const std::vector<Dim>& dims = stage.schedule.dims;
  return std::any_of(dims.begin(), dims.end() - static_cast<long>(shared),
                     [](const Dim& loop) { return loop.is_reduction; });
}

// The dimensions in the order in which they lie in memory.
const std::vector<std::string>& dimensions_in_memory(const FuncContents& f) {
  return f.schedule.storage_dims.empty() ? f.args : f.schedule.storage_dims;
}

}  // namespace

std::vector<TileLoop> tile_loops(const FuncContents& f, const Definition& stage) {
  std::vector<TileLoop> result;
  const std::vector<Dim>& dims = stage.schedule.dims;
  for (auto loop = dims.rbegin(); loop != dims.rend(); ++loop) {
    const auto tile = tile_loop(f, stage, *loop);
    const bool is_part = tile && tile->loop.var != tile->dimension;
    const bool follows = std::any_of(result.begin(), result.end(), [&](const TileLoop& outer) {
      return tile && outer.dimension == tile->dimension;
    });
    if (!tile || is_part != follows) break;
    result.push_back(*tile);
  }
  return result;
}

const Split* split_of_phases(const Definition& stage, const std::string& row) {
  const auto is_unrolled = [&](const std::string& loop) {
    return std::ranges::any_of(stage.schedule.dims, [&](const Dim& dim) {
      return dim.var == loop && dim.runs == ForType::Unrolled && !dim.is_reduction;
    });
  };
  const auto found = std::ranges::find_if(stage.schedule.splits, [&](const Split& made) {
    return made.kind == Split::Kind::Split && made.old_var == row && made.outer == row &&
           is_unrolled(made.inner);
  });
  return found == stage.schedule.splits.end() ? nullptr : &*found;
}

bool has_tiles(const FuncContents& f) {
  if (f.updates.empty() || f.updates[0].schedule.fuse_level.kind == graph::LoopLevel::Kind::At)
    return false;
  const Definition& update = f.updates[0];
  const std::vector<TileLoop> tiles = tile_loops(f, update);
  const bool cuts = std::any_of(tiles.begin(), tiles.end(),
                                [](const TileLoop& tile) { return tile.split != nullptr; });
  bool stays = !read_elsewhere(f, update).defined();
  for (size_t d = 0; d < f.args.size(); ++d) stays &= is_pure_position(f, update, d);
  return cuts && (stays || runs_along_row(f, update)) && has_reduction_inside(update, tiles.size());
}

void start_in_tiles(const FuncPtr& f, int lanes) {
  const std::vector<TileLoop> tiles = tile_loops(*f, f->updates[0]);
  Stage start(f, 0);
  std::map<std::string, std::string> inside;  // of the loops over tiles, by dimension
  std::vector<VarOrRVar> shared;
  for (const TileLoop& tile : tiles) {
    shared.insert(shared.begin(), Var(tile.loop.var));
    std::string& part = inside[tile.dimension];
    if (tile.loop.var != tile.dimension) {
      part.clear();
    } else if (tile.split) {
      part = tile.split->inner;
      start.split(Var(tile.dimension), Var(tile.dimension), Var(part), tile.split->factor,
                  TailStrategy::GuardWithIf);
    }
  }
  std::vector<VarOrRVar> order;
  const std::vector<std::string>& dimensions = dimensions_in_memory(*f);
  for (const std::string& arg : dimensions) {
    const auto part = inside.find(arg);
    const std::string loop = part == inside.end() ? arg : part->second;
    if (!loop.empty()) order.emplace_back(Var(loop));
  }
  const bool has_rows =
      inside.find(dimensions[0]) == inside.end() || !inside[dimensions[0]].empty();
  const std::vector<VarOrRVar> held = order;
  const Split* phases = has_rows ? split_of_phases(f->updates[0], held.front().name()) : nullptr;
  if (phases) {
    const Var row(phases->old_var), phase(phases->inner);
    start.split(row, row, phase, phases->factor, TailStrategy::GuardWithIf).unroll(phase);
    order.insert(order.begin() + 1, phase);
  }
  order.insert(order.end(), shared.begin(), shared.end());
  start.reorder(order);
  // As the update has them: then its sums start in registers.
  const std::string row = held.empty() ? "" : held.front().name();
  const std::vector<Dim>& loops = f->updates[0].schedule.dims;
  const bool is_whole = std::any_of(loops.begin(), loops.end(), [&](const Dim& loop) {
    return loop.var == row && loop.runs == ForType::Vectorized;
  });
  if (has_rows && is_whole)
    start.vectorize(held.front());
  else if (has_rows)
    vectorize(start, held.front(), lanes, TailStrategy::GuardWithIf);
  for (const TileLoop& tile : tiles) {
    if (tile.loop.runs == ForType::Parallel) start.parallel(Var(tile.loop.var));
  }
  Stage(f, 1).compute_with(start, shared.front());
}

}  // namespace retrograde::autoschedule
