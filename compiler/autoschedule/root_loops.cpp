#include "autoschedule/root_loops.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "autoschedule/cost_estimate.h"
#include "autoschedule/inlined_reads.h"
#include "autoschedule/long_sums.h"
#include "autoschedule/look_ups.h"
#include "autoschedule/loop_order.h"
#include "autoschedule/new_loop.h"
#include "autoschedule/packed_operand.h"
#include "autoschedule/phase_loops.h"
#include "autoschedule/reduction_chunks.h"
#include "autoschedule/row_copies.h"
#include "autoschedule/row_reductions.h"
#include "autoschedule/row_scans.h"
#include "autoschedule/scatter_schedule.h"
#include "autoschedule/short_rows.h"
#include "autoschedule/step_loops.h"
#include "autoschedule/turned_loops.h"
#include "autoschedule/turned_sums.h"
#include "autoschedule/vector_chains.h"
#include "frontend/language/func.h"
#include "frontend/language/rdom.h"
#include "frontend/schedule/stage.h"
#include "graph/definitions/own_reads.h"
#include "graph/directives/give_directive.h"
#include "ir/build.h"
#include "ir/memory_reads.h"
#include "ir/visit.h"

namespace retrograde::autoschedule {

namespace {

constexpr int scan_vectors = 8;      // of a row, in a block of columns
constexpr int64_t small_shift = 16;  // values of a dimension, such as the taps of a filter

// A dimension beyond the first that runs along the rows of what a pure stage reads, through what is
// computed inline too, while the first one runs across them.
std::optional<size_t> transposed_dimension(const FuncContents& f, const Definition& stage) {
  std::optional<size_t> result;
  if (!stage.rvars.empty() || f.args.size() < 2) return result;
  for (const Expr& root : roots_with_inlined(stage)) {
    walk(root, [&](const Expr& e) {
      const auto* call = e.as<Call>();
      if (!call || call->call_type == CallType::Operator || call->args.size() < 2) return true;
      const Expr& row = call->args[innermost_dimension(*call)];
      const bool across = !uses_variable(row, f.args[0]) &&
                          std::any_of(call->args.begin(), call->args.end(), [&](const Expr& arg) {
                            return uses_variable(arg, f.args[0]);
                          });
      for (size_t d = 1; across && d < f.args.size(); ++d) {
        if (is_pure_position(f, stage, d) && uses_variable(row, f.args[d])) result = d;
      }
      return true;
    });
  }
  return result;
}

// The blocks that a stage adds up, where they are computed for it alone.
FuncPtr block_of(const Definition& stage) {
  FuncPtr result;
  for_each_expr(stage, [&](const Expr& root) {
    walk(root, [&](const Expr& e) {
      const auto* call = e.as<Call>();
      const FuncPtr callee = call && call->call_type == CallType::Func ? func_of(*call) : nullptr;
      const bool is_block = callee && callee->made && callee->made->blocks > 0;
      if (is_block && !has_directives(*callee)) result = callee;
      return true;
    });
  });
  return result;
}

// Pure dimensions only: their iterations are independent whatever the stage does.
class LoopChooser {
 public:
  LoopChooser(const FuncPtr& f, int stage, const ScheduleRequest& request,
              const SizeEstimate& sizes)
      : function_(f), f_(*f), index_(stage), stage_(f, stage), request_(request), sizes_(sizes) {
    for (size_t d = 0; d < f_.args.size(); ++d) {
      if (is_pure_position(f_, definition(), d)) pure_.push_back(d);
    }
  }

  void give() {
    const bool may_scatter = makes(Decision::ScatterStrategy);
    const bool scatters = may_scatter && scatters_in_order(f_, definition());
    if (scatters)
      schedule_scatter_in_order(f_, index_, stage_);
    else if (may_scatter)
      unroll_taps(definition(), stage_);
    if (const FuncPtr block = block_of(definition())) return give_blocks(block);
    if (makes(Decision::LayoutStaging) && add_turned_lanes(function_, index_, schedule_lanes))
      return;
    if (!scatters && turn_sum()) return;
    const bool has_pure_rows = !pure_.empty() && pure_[0] == 0;
    if (!scatters && !has_pure_rows && schedule_steps(function_, index_, lanes_of_values(), sizes_))
      return;
    const auto row = scatters ? std::nullopt : row_to_reduce();
    if (pure_.empty()) return row ? reduce_along_rows(function_, index_, *row) : void();
    const bool stages = makes(Decision::LayoutStaging);
    if (auto d = stages && pure_[0] == 0 ? transposed_dimension(f_, definition()) : std::nullopt)
      return tile(*d);
    if (stages && !scatters && schedule_look_ups(f_, index_, stage_, lanes_of_values(), sizes_))
      return;
    if (stages && schedule_short_rows(f_, index_, stage_, lanes_of_values(), sizes_)) return;
    // Phases that a vector is no multiple of come first if a tile has none: there its lanes would gather.
    const bool has_phases = pure_[0] == 0 && !scatters &&
                            has_odd_phases(f_, definition(), schedule_lanes) &&
                            phases_of_tile(f_, definition(), schedule_lanes, sizes_) == 1;
    const bool may_be_tile =
        !scatters && !point_number(definition()) && pure_[0] == 0 && !has_phases;
    if (may_be_tile && tile_in_registers(row.has_value())) return;
    if (row) return reduce_rows(*row);
    if (pure_[0] == 0 && scans_rows()) return cut_scan();
    if (may_be_tile && sums_in_blocks()) return;
    if (index_ > 0 && !scatters && pure_[0] != 0 && makes(Decision::LayoutStaging))
      schedule_row_scan(function_, index_, sizes_);
    make_tasks();
    if (pure_[0] != 0) return;
    const bool reduces = !definition().rvars.empty();
    if (scatters || !split_into_phases(f_, index_, stage_, lanes_of_values(), sizes_))
      vectorize(stage_, variable_of(0), lanes_of_body(), TailStrategy::GuardWithIf);
    if (pure_.size() == 1 && reduces) stage_.parallel(variable_of(0));  // of the vectors
  }

  void give_tile(const RegisterTile& tile) {
    if (makes(Decision::ScatterStrategy)) unroll_taps(definition(), stage_);
    cut(tile, {}, true);
  }

  void give_along(size_t dimension) {
    std::vector<Var> order{variable_of(dimension)};
    for (size_t d = 0; d < f_.args.size(); ++d) {
      if (d != dimension) order.push_back(variable_of(d));
    }
    Func(function_).reorder_storage(order);
    stage_.reorder(std::vector<VarOrRVar>(order.begin(), order.end()));
    int64_t tasks = 1;
    for (size_t d = f_.args.size(); d-- > 0 && tasks < sizes_.machine().enough_tasks();) {
      if (d == dimension) continue;
      stage_.parallel(variable_of(d));
      tasks *= sizes_.extent(f_, d).value_or(sizes_.machine().enough_tasks());
    }
    vectorize(stage_, order[0], lanes_of_values(), TailStrategy::GuardWithIf);
  }

 private:
  bool makes(Decision decision) const { return request_.makes(decision); }
  const Definition& definition() const { return f_.stage(index_); }
  Var variable_of(size_t dimension) const { return Var(f_.args[dimension]); }
  Var inside(const Var& loop) const { return Var(inner_loop(f_, index_, loop.name())); }

  // Private sums may be of fewer lanes.
  int most_lanes() const {
    return f_.made && f_.made->lanes > 0 ? std::min(schedule_lanes, f_.made->lanes)
                                         : schedule_lanes;
  }
  // A register of narrow numbers holds more of them.
  int lanes_of_values() const {
    if (most_lanes() < schedule_lanes) return most_lanes();
    return std::clamp(schedule_lanes * 32 / bits_of_values(definition().values), schedule_lanes,
                      4 * schedule_lanes);
  }

  // A long body gets vectors of several registers where rows fill these many times.
  int lanes_of_body() const {
    const int own = lanes_of_values();
    const auto row = sizes_.extent(f_, 0);
    return own == schedule_lanes && row && *row >= 16 * schedule_lanes
               ? own * vectors_side_by_side(f_)
               : own;
  }

  // The outermost loop, and those inside of it while their iterations are few; not that of the
  // vectors, if elements are their lanes. How many private parts there are may be known at run time
  // only: few, where the target is large.
  void make_tasks(bool elements_are_lanes = true) {
    const int64_t unknown = f_.made && f_.made->has_parts ? 1 : sizes_.machine().enough_tasks();
    int64_t tasks = 1;
    for (size_t i = pure_.size(); i-- > 0 && tasks < sizes_.machine().enough_tasks();) {
      if (pure_[i] == 0 && elements_are_lanes) break;
      stage_.parallel(variable_of(pure_[i]));
      tasks *= sizes_.extent(f_, pure_[i]).value_or(unknown);
    }
  }

  // Whether the update is a long sum of floats that the user wrote: vectors of elements add its terms in blocks.
  bool sums_in_blocks() {
    if (f_.made || !makes(Decision::CutReductions)) return false;
    const std::vector<ReductionVariable> loops = reduction_loops(f_, definition());
    if (!is_long_sum(f_, definition(), loops)) return false;
    const Var x = variable_of(0), lane = inside(x);
    std::vector<VarOrRVar> order{lane};
    for (const ReductionVariable& r : loops) order.push_back(RVar(r.var));
    for (const size_t d : pure_) order.push_back(variable_of(d));
    stage_.split(x, x, lane, lanes_of_values(), TailStrategy::GuardWithIf)
        .reorder(order)
        .vectorize(lane);
    add_in_blocks(function_, index_, loops, 1);
    make_tasks();
    if (pure_.size() == 1) stage_.parallel(x);  // the vectors
    return true;
  }

  // Whether an update takes elements of other rows that it has made before.
  bool scans_rows() const {
    const Definition& update = definition();
    if (index_ == 0 || point_number(update) || !read_elsewhere(f_, update).defined()) return false;
    const auto moves_row = [&](const ReductionVariable& r) {
      return std::any_of(update.args.begin() + 1, update.args.end(),
                         [&](const Expr& arg) { return uses_variable(arg, r.var); });
    };
    return !update.rvars.empty() &&
           std::all_of(update.rvars.begin(), update.rvars.end(), moves_row);
  }

  // Row after row, in blocks of columns that are the tasks: a row of one is a few lines of a cache.
  void cut_scan() {
    const Var x = variable_of(0), vectors = inside(x);
    const Var lane(new_loop(f_, index_, "lane"));
    stage_.split(x, x, vectors, scan_vectors * schedule_lanes, TailStrategy::GuardWithIf);
    stage_.split(vectors, vectors, lane, schedule_lanes, TailStrategy::GuardWithIf).vectorize(lane);
    std::vector<VarOrRVar> order{lane, vectors};
    for (const ReductionVariable& r : definition().rvars) order.push_back(RVar(r.var));
    order.push_back(x);
    for (size_t d : pure_) {
      if (d != 0) order.push_back(variable_of(d));
    }
    stage_.reorder(order).parallel(x);
    make_tasks();
  }

  std::optional<RowReduction> row_to_reduce() const {
    if (index_ == 0 || !makes(Decision::LayoutStaging)) return std::nullopt;
    return row_reduction(f_, definition(), lanes_of_values(), request_.machine, sizes_);
  }

  // Rows are the tasks.
  void reduce_rows(const RowReduction& row) {
    reduce_along_rows(function_, index_, row);
    if (!row.is_short) make_tasks(false);
  }

  // Whether there is a tile. `in_rows`: the reduction can run along rows, as a tile that reads across them would not.
  bool tile_in_registers(bool in_rows) {
    const auto tile = tile_of(f_, definition());
    if (!tile) return false;
    const auto packed = makes(Decision::LayoutStaging)
                            ? packed_operand(f_, definition(), *tile, schedule_lanes, sizes_)
                            : std::nullopt;
    const auto rows = packed ? std::nullopt : copied_rows(*tile);
    if (in_rows && !packed && !rows) return false;
    const bool packs_whole = packed && packed->is_whole;
    std::vector<VarOrRVar> loops = cut(*tile, {}, rows || (packed && !packs_whole));
    if (packs_whole)
      pack_whole(sums_of_terms(*tile, in_rows), *packed, schedule_lanes);
    else if (packed)
      loops = pack_inside(*packed, loops);
    if (rows) copy_rows_inside(*rows, loops);
    if (!packed && !rows && makes(Decision::LayoutStaging)) share_chunks(*tile, loops);
    run_in_parallel(loops, *tile, packed.has_value());
    return true;
  }

  // The Func whose tiles add up the terms: if they are many, it is one of blocks of them, since a tile that was along
  // rows would be more exact.
  FuncPtr sums_of_terms(const RegisterTile& tile, bool in_rows) {
    const int64_t most = in_rows ? long_chain_instead_of_rows : long_chain;
    const std::vector<ReductionVariable> loops = reduction_loops(f_, definition());
    if (!is_long_sum(f_, definition(), loops, 1, most)) return function_;
    const FuncPtr blocks = add_in_blocks(function_, index_, loops, 1);
    LoopChooser(blocks, 0, request_, sizes_).cut(tile);
    return blocks;
  }

  // Moves the loops over tiles into those over chunks of the reduction.
  void share_chunks(const RegisterTile& tile, const std::vector<VarOrRVar>& tiles) {
    const bool is_own = f_.made && (f_.made->lanes > 0 || f_.made->has_parts);
    const auto chunk =
        index_ == 1 && !is_own ? chunk_of_terms(f_, tile, schedule_lanes, sizes_) : std::nullopt;
    if (!chunk) return;
    const std::vector<ReductionVariable> loops = reduction_loops(f_, definition());
    std::vector<VarOrRVar> order;
    for (size_t i = 0; i <= chunk->loop; ++i) order.emplace_back(RVar(loops[i].var));
    order.insert(order.end(), tiles.begin(), tiles.end());
    if (chunk->iterations > 0) {
      const RVar iteration(loops[chunk->loop].var), chunks(new_loop(f_, index_, "chunks"));
      stage_.split(iteration, chunks, iteration, static_cast<int>(chunk->iterations),
                   TailStrategy::GuardWithIf);
      order.emplace_back(chunks);
    }
    for (size_t i = chunk->loop + 1; i < loops.size(); ++i) order.emplace_back(RVar(loops[i].var));
    stage_.reorder(order);
  }

  // Of the loops over tiles, those that do not move the operand come first. The result: the others,
  // around the blocks of the reduction, where one copy is of a block.
  std::vector<VarOrRVar> pack_inside(const PackedOperand& operand,
                                     const std::vector<VarOrRVar>& loops) {
    const auto moves = [&](const VarOrRVar& loop) {
      const auto arg = std::find(f_.args.begin(), f_.args.end(), loop.name());
      return bool(operand.depends_on[static_cast<size_t>(arg - f_.args.begin())]);
    };
    std::vector<VarOrRVar> order = loops;
    const auto first = std::stable_partition(order.begin(), order.end(), std::not_fn(moves));
    const std::vector<VarOrRVar> outside(first, order.end());
    if (operand.rows) return pack_rows(operand, std::move(order), outside);
    VarOrRVar level = outside[0];
    if (operand.block) {
      const RVar iteration(operand.block->loop), blocks(new_loop(f_, index_, "blocks"));
      stage_.split(iteration, blocks, iteration, static_cast<int>(operand.block->iterations));
      level = *order.insert(first, blocks);
    }
    stage_.reorder(order);
    pack(function_, operand, retrograde::LoopLevel(Func(function_), level), schedule_lanes);
    return outside;
  }

  // One copy for several rows of tiles: their loop stands inside of those that move the operand.
  std::vector<VarOrRVar> pack_rows(const PackedOperand& operand, std::vector<VarOrRVar> order,
                                   const std::vector<VarOrRVar>& outside) {
    const Var rows = variable_of(operand.rows->dimension), row = inside(rows);
    stage_.split(rows, rows, row, static_cast<int>(operand.rows->count), TailStrategy::GuardWithIf);
    order.insert(order.end() - static_cast<long>(outside.size()), row);
    stage_.reorder(order);
    pack(function_, operand, retrograde::LoopLevel(Func(function_), outside[0]), schedule_lanes);
    return outside;
  }

  std::optional<RowCopy> copied_rows(const RegisterTile& tile) const {
    // Sums of the scheduler's own are few.
    const bool is_own = f_.made && (f_.made->lanes > 0 || f_.made->has_parts);
    if (is_own || !makes(Decision::LayoutStaging)) return std::nullopt;
    std::vector<size_t> order{0};  // of the loops that cut() makes
    for (const RegisterTile::Side& side : tile.sides) order.push_back(side.dimension);
    for (const size_t d : pure_) {
      if (std::find(order.begin(), order.end(), d) == order.end()) order.push_back(d);
    }
    const auto copy = row_copy(f_, tile, schedule_lanes, {order, {}}, sizes_);
    return copy && !is_to_be_inlined(*copy->source) ? copy : std::nullopt;
  }
  bool is_to_be_inlined(const FuncContents& f) const {
    const auto& inlined = request_.options.inlined;
    return request_.recomputed.contains(f.name) ||
           std::find(inlined.begin(), inlined.end(), FuncName(f.name)) != inlined.end();
  }

  // Several rows of tiles for one copy stand inside of its loop.
  void copy_rows_inside(const RowCopy& copy, const std::vector<VarOrRVar>& loops) {
    const Var rows = variable_of(copy.dimension);
    if (copy.rows > 1) {
      const Var row = inside(rows);
      stage_.split(rows, rows, row, static_cast<int>(copy.rows), TailStrategy::GuardWithIf);
      std::vector<VarOrRVar> order;
      for (const VarOrRVar& loop : loops) {
        if (loop.name() == rows.name()) order.push_back(row);
        order.push_back(loop);
      }
      stage_.reorder(order);
    }
    copy_rows(function_, copy, retrograde::LoopLevel(Func(function_), rows), schedule_lanes);
  }

  // The outermost of them, and where that may be short the next one too: a loop in parallel inside of
  // another is launched for each of its iterations. `has_copies`: each iteration of the innermost copies what many tiles
  // read, so that it is work enough for a task.
  void run_in_parallel(const std::vector<VarOrRVar>& loops, const RegisterTile& tile,
                       bool has_copies = false) {
    stage_.parallel(loops.back());
    if (loops.size() > (has_copies ? 1 : 2) &&
        iterations_of(loops.back(), tile) < sizes_.machine().enough_tasks())
      stage_.parallel(loops[loops.size() - 2]);
  }

  // Of a loop over tiles; 0: not known.
  int64_t iterations_of(const VarOrRVar& loop, const RegisterTile& tile) const {
    const auto arg = std::find(f_.args.begin(), f_.args.end(), loop.name());
    if (arg == f_.args.end()) return 0;
    const auto dimension = static_cast<size_t>(arg - f_.args.begin());
    const int64_t size = tile.size_along(dimension, schedule_lanes);
    return (sizes_.extent(f_, dimension).value_or(0) + size - 1) / size;
  }

  std::optional<RegisterTile> tile_of(const FuncContents& f, const Definition& reduction) const {
    if (!makes(Decision::RegisterTiles)) return std::nullopt;
    const bool has_lanes = f.made && f.made->lanes > 0;
    const planning::Machine& machine = request_.machine;
    const int64_t phases = phases_of_tile(f, reduction, schedule_lanes, sizes_);
    if (phases > 1) {
      if (auto tile = register_tile(f, reduction, schedule_lanes, 2, machine, sizes_, phases))
        return tile;
    }
    return register_tile(f, reduction, schedule_lanes, has_lanes ? 1 : 4, machine, sizes_);
  }

  // Its loops stand inside of those of the reduction; those over tiles outside, of the sides first,
  // so that what the last dimensions run over stays in the cache; `between` just inside of those of
  // the reduction. The result: those outside.
  // `is_whole`: vectors of one row are one loop, of which bounds know where its guard ends it.
  std::vector<VarOrRVar> cut(const RegisterTile& tile, const std::vector<size_t>& between = {},
                             bool is_whole = false) {
    std::vector<VarOrRVar> inner, outer;
    const auto cut = [&](size_t d, int64_t size) {
      const Var all = variable_of(d), part = inside(all);
      stage_.split(all, all, part, Expr(static_cast<int>(size)), TailStrategy::GuardWithIf);
      inner.push_back(part);
      outer.push_back(all);
    };
    cut(0, tile.phases * tile.vectors * most_lanes());
    for (const RegisterTile::Side& side : tile.sides) cut(side.dimension, side.size);
    std::vector<VarOrRVar> order = inner;
    if (tile.phases > 1) {
      const Var phase(new_loop(f_, index_, "phase"));
      stage_.split(inner[0], inner[0], phase, static_cast<int>(tile.phases)).unroll(phase);
      order.insert(order.begin() + 1, phase);
    }
    for (size_t d : between) order.push_back(variable_of(d));
    for (const ReductionVariable& r : reduction_loops(f_, definition()))
      order.push_back(RVar(r.var));
    for (size_t d : pure_) {
      const Var all = variable_of(d);
      const auto is_it = [&](const VarOrRVar& loop) { return loop.name() == all.name(); };
      if (std::none_of(outer.begin(), outer.end(), is_it) &&
          std::none_of(order.begin(), order.end(), is_it))
        outer.push_back(all);
    }
    order.insert(order.end(), outer.begin(), outer.end());
    stage_.reorder(order);
    if (tile.vectors > 1 && !is_whole) {
      const Var vector(new_loop(f_, index_, "vector"));
      stage_.split(inner[0], inner[0], vector, schedule_lanes).vectorize(vector).unroll(inner[0]);
    } else {
      stage_.vectorize(inner[0]);
    }
    for (size_t i = 1; i < inner.size(); ++i) stage_.unroll(inner[i]);
    return outer;
  }

  // A tile of another Func by the same variables' dimensions of this one.
  RegisterTile renumbered(RegisterTile tile, const FuncContents& other) const {
    for (RegisterTile::Side& side : tile.sides) {
      const auto found = std::find(f_.args.begin(), f_.args.end(), other.args[side.dimension]);
      side.dimension = static_cast<size_t>(found - f_.args.begin());
    }
    return tile;
  }

  // Small dimensions along which a step moves what a block reads by a little only: all of one part
  // of the reduction is done for each of them, while it is in the cache. The other tiles must be
  // tasks enough.
  std::vector<size_t> shifts_of(const FuncContents& block, const RegisterTile& tile) const {
    std::vector<size_t> shifts;
    int64_t tasks = 1;
    for (size_t d : pure_) {
      const int64_t size = tile.size_along(d, schedule_lanes);
      const auto arg = std::find(block.args.begin(), block.args.end(), f_.args[d]);
      const auto in_block = static_cast<size_t>(arg - block.args.begin());
      const int64_t extent = sizes_.extent(f_, d).value_or(sizes_.machine().enough_tasks() * size);
      const bool is_shift = size == 1 && extent <= small_shift && sizes_.extent(f_, d) &&
                            arg != block.args.end() &&
                            shifts_reads(block, block.updates[0], in_block);
      if (is_shift)
        shifts.push_back(d);
      else
        tasks *= (extent + size - 1) / size;
    }
    return tasks >= sizes_.machine().enough_tasks() ? shifts : std::vector<size_t>();
  }

  // The sums of a tile: a block of each after the other, in registers, is added to what memory
  // holds.
  void give_blocks(const FuncPtr& block) {
    if (makes_turned_tiles()) {
      auto turned = turned_lanes(*block, schedule_lanes, request_.machine, sizes_);
      if (!turned && has_idle_rows() && block->updates.size() == 1)
        turned = turned_sum(*block, block->updates[0], schedule_lanes, request_.machine, sizes_);
      if (turned) return give_turned_blocks(block, *turned);
    }
    if (pure_.empty() || pure_[0] != 0) return compute_block(block, {});
    const RegisterTile tile = tile_of(*block, block->updates[0]).value_or(RegisterTile());
    const RegisterTile own = renumbered(tile, *block);
    const std::vector<size_t> shifts = shifts_of(*block, own);
    compute_block(block, shifts);
    const std::vector<VarOrRVar> tiles = cut(own, shifts);
    const auto chunk =
        makes(Decision::LayoutStaging) ? cut_into_chunks(*block, tiles, own) : std::nullopt;
    if (chunk) copy_rows_of_chunk(block, tile, tiles, shifts, *chunk);
    run_in_parallel(tiles, own);
    for (int s = 0; s < block->stage_count(); ++s)
      LoopChooser(block, s, request_, sizes_).cut(tile);
  }

  bool makes_turned_tiles() const {
    return makes(Decision::LayoutStaging) && makes(Decision::RegisterTiles);
  }
  // Whether vectors along the first dimension would be nearly empty.
  bool has_idle_rows() const {
    if (pure_.empty() || f_.args.size() < 2) return false;
    return pure_[0] != 0 || 2 * sizes_.extent(f_, 0).value_or(schedule_lanes) <= schedule_lanes;
  }
  // Adds up the terms in a Func of its own, whose rows lie along another dimension; the update adds its sums. Returns
  // false if other loops are as good.
  bool turn_sum() {
    if (index_ == 0 || !makes_turned_tiles() || !has_idle_rows()) return false;
    const auto turned = turned_sum(f_, definition(), schedule_lanes, request_.machine, sizes_);
    if (!turned) return false;
    std::vector<RVar> terms;
    for (const ReductionVariable& r : reduction_loops(f_, definition())) terms.emplace_back(r.var);
    const FuncPtr sums = stage_.rfactor(std::vector<std::pair<RVar, Var>>()).function();
    Func(sums).compute_root();
    const std::vector<VarOrRVar> tiles = give_turned_loops(sums, *turned, terms, schedule_lanes);
    for (int s = 0; s < sums->stage_count(); ++s) {
      for (size_t i = tiles.size(); i-- > 0 && i + 2 >= tiles.size();)
        Stage(sums, s).parallel(tiles[i]);
    }
    add_turned_sums(function_, index_, turned->dimension, schedule_lanes);
    return true;
  }

  void give_turned_blocks(const FuncPtr& block, const TurnedSum& turned) {
    const RegisterTile own = renumbered(turned.tile(schedule_lanes), *block);
    const std::vector<size_t> shifts = shifts_of(*block, own);
    compute_block(block, shifts);
    std::vector<Var> between;
    for (const size_t d : shifts) between.push_back(variable_of(d));
    run_in_parallel(give_turned_loops(function_, block, turned, between, schedule_lanes), own);
  }

  // The loops over tiles stand inside of those over chunks of the reduction. The result: iterations of
  // its first loop that a chunk has.
  std::optional<int64_t> cut_into_chunks(const FuncContents& block,
                                         const std::vector<VarOrRVar>& tiles,
                                         const RegisterTile& tile) {
    const std::vector<ReductionVariable> loops = reduction_loops(f_, definition());
    const auto chunk = reduction_chunk(f_, block, loops[0], tile, schedule_lanes, sizes_);
    if (!chunk) return std::nullopt;
    const RVar iteration(loops[0].var), chunks(new_loop(f_, index_, "chunks"));
    stage_.split(iteration, chunks, iteration, static_cast<int>(*chunk));
    std::vector<VarOrRVar> order{iteration};
    order.insert(order.end(), tiles.begin(), tiles.end());
    order.push_back(chunks);
    for (size_t i = 1; i < loops.size(); ++i) order.push_back(RVar(loops[i].var));
    stage_.reorder(order);
    return chunk;
  }

  // What all blocks of a chunk read through a boundary condition, say; the tile is the block's.
  void copy_rows_of_chunk(const FuncPtr& block, const RegisterTile& tile,
                          const std::vector<VarOrRVar>& tiles, const std::vector<size_t>& shifts,
                          int64_t chunk) {
    const auto in_block = [&](const std::string& name) {
      const auto arg = std::find(block->args.begin(), block->args.end(), name);
      return static_cast<size_t>(arg - block->args.begin());
    };
    LoopsOfTiles loops;
    for (const VarOrRVar& loop : tiles) loops.tiles.push_back(in_block(loop.name()));
    for (const size_t d : shifts) loops.inside.push_back(in_block(f_.args[d]));
    const auto number = number_along(f_, *block, reduction_loops(f_, definition())[0].var);
    if (!number || std::ranges::count(loops.tiles, block->args.size()) > 0) return;
    loops.inside.push_back(*number);
    const auto copy =
        row_copy(*block, tile, schedule_lanes, loops, sizes_.with_extent(*block, *number, chunk));
    if (!copy || is_to_be_inlined(*copy->source)) return;
    const Var rows(block->args[copy->dimension]);
    copy_rows(block, *copy, retrograde::LoopLevel(Func(function_), rows), schedule_lanes);
  }

  // For each iteration of the innermost loop outside of the tile.
  void compute_block(const FuncPtr& block, const std::vector<size_t>& shifts) {
    if (shifts.empty()) {
      const RVar each(reduction_loops(f_, definition())[0].var);
      Func(block).compute_at(Func(function_), each);
    } else {
      Func(block).compute_at(Func(function_), variable_of(shifts[0]));
    }
  }

  // Squares, whose rows stay in the cache until their columns are read, one row of them after the
  // other.
  void tile(size_t dimension) {
    const Var x = variable_of(0), y = variable_of(dimension), xi = inside(x);
    stage_.split(x, x, xi, schedule_lanes, TailStrategy::GuardWithIf);
    const Var yi = inside(y);
    stage_.split(y, y, yi, schedule_lanes, TailStrategy::GuardWithIf);
    std::vector<VarOrRVar> order{xi, yi};
    for (const size_t d : pure_) order.push_back(variable_of(d));
    stage_.reorder(order).vectorize(xi);
    stage_.parallel(variable_of(pure_.back()));
  }

  const FuncPtr function_;
  const FuncContents& f_;
  const int index_;
  Stage stage_;
  const ScheduleRequest& request_;
  const SizeEstimate& sizes_;
  std::vector<size_t> pure_;  // dimensions
};

}  // namespace

void give_root_loops(const FuncPtr& f, int stage, const ScheduleRequest& request,
                     const SizeEstimate& sizes) {
  LoopChooser(f, stage, request, sizes).give();
}

void give_loops_of_tile(const FuncPtr& f, int stage, const RegisterTile& tile,
                        const ScheduleRequest& request, const SizeEstimate& sizes) {
  LoopChooser(f, stage, request, sizes).give_tile(tile);
}

void give_loops_along(const FuncPtr& f, size_t dimension, const ScheduleRequest& request,
                      const SizeEstimate& sizes) {
  LoopChooser(f, 0, request, sizes).give_along(dimension);
}

}  // namespace retrograde::autoschedule
