#include "autoschedule/turned_loops.h"

#include <algorithm>
#include <string>

#include "autoschedule/loop_order.h"
#include "autoschedule/new_loop.h"
#include "frontend/language/func.h"
#include "frontend/language/rdom.h"
#include "graph/definitions/own_reads.h"
#include "ir/build.h"

namespace retrograde::autoschedule {

namespace {

// Rows in memory along a dimension, whose name is given.
void store_rows_along(const FuncPtr& f, const std::string& row) {
  std::vector<Var> order{Var(row)};
  for (const std::string& arg : f->args) {
    if (arg != row) order.emplace_back(arg);
  }
  Func(f).reorder_storage(order);
}

bool innermost_is_moved(const FuncContents& f) {
  const std::vector<std::string>& dimensions = f.schedule.storage_dims;
  return !dimensions.empty() && dimensions[0] != f.args[0];
}

// A tile by the names of dimensions, which a block shares with the sums that it is added to.
struct NamedTile {
  std::string row;
  int64_t row_size = 1;
  struct Side {
    std::string name;
    int64_t size;
  };
  std::vector<Side> sides;

  NamedTile(const FuncContents& f, const TurnedSum& turned, int lanes)
      : row(f.args[turned.dimension]), row_size(turned.vectors * lanes) {
    for (const RegisterTile::Side& side : turned.sides)
      sides.push_back({f.args[side.dimension], side.size});
  }
};

// The loops of a stage over a tile: vectors of so many lanes along the row, then its sides. What is outside of the tile
// along these keeps the names.
std::vector<VarOrRVar> cut_tile(const FuncPtr& f, int index, const NamedTile& tile, int lanes) {
  Stage stage(f, index);
  const auto cut = [&](const std::string& name, int64_t size) {
    const Var all(name), part(inner_loop(*f, index, name));
    stage.split(all, all, part, static_cast<int>(size), TailStrategy::GuardWithIf);
    return part;
  };
  const Var in_row = cut(tile.row, tile.row_size);
  const Var vector(new_loop(*f, index, "vector"));
  stage.split(in_row, in_row, vector, lanes, TailStrategy::GuardWithIf);
  stage.vectorize(vector).unroll(in_row);
  std::vector<VarOrRVar> loops{vector, in_row};
  for (const NamedTile::Side& side : tile.sides) {
    loops.emplace_back(cut(side.name, side.size));
    stage.unroll(Var(loops.back().name()));
  }
  return loops;
}

// Appends the loops over dimensions that the order lacks. An update has none over those whose places are fixed.
void append_others(std::vector<VarOrRVar>& order, const FuncContents& f, int index) {
  for (size_t d = 0; d < f.args.size(); ++d) {
    const auto is_it = [&](const VarOrRVar& loop) { return loop.name() == f.args[d]; };
    if (is_pure_position(f, f.stage(index), d) && std::ranges::none_of(order, is_it))
      order.emplace_back(Var(f.args[d]));
  }
}

void append_reduction(std::vector<VarOrRVar>& order, const FuncContents& f, int index) {
  for (const ReductionVariable& r : reduction_loops(f, f.stage(index)))
    order.emplace_back(RVar(r.var));
}

void copy_operands(const FuncPtr& f, const TurnedSum& turned, int lanes) {
  for (const PackedOperand& operand : turned.copies) pack_whole(f, operand, lanes);
}

// The dimension of the update's Func along which rows lie of the turned lanes that it adds; nullopt: it adds none.
std::optional<size_t> row_of_turned_lanes(const FuncContents& f, const Definition& update) {
  std::optional<size_t> result;
  bool is_alone = update.values.size() == 1;
  walk_definition(update, [&](const Expr& e) {
    const auto* call = e.as<Call>();
    if (!call || call->call_type == CallType::Operator || call->name == f.name) return;
    const FuncPtr parts = call->call_type == CallType::Func ? func_of(*call) : nullptr;
    const size_t row = innermost_dimension(*call);
    const bool is_turned = parts && parts->made && parts->made->lanes > 0 && row > 0;
    const auto* place = is_turned ? call->args[row].as<Variable>() : nullptr;
    const auto arg = place ? std::ranges::find(f.args, place->name) : f.args.end();
    is_alone = is_alone && arg != f.args.end() && !result;
    result = static_cast<size_t>(arg - f.args.begin());
  });
  return is_alone ? result : std::nullopt;
}

}  // namespace

std::vector<VarOrRVar> give_turned_loops(const FuncPtr& sums, const FuncPtr& block,
                                         const TurnedSum& turned, const std::vector<Var>& between,
                                         int lanes) {
  const NamedTile tile(*block, turned, lanes);
  const bool has_lanes = block->made->lanes > 0;
  const Var lane(block->args[0]);
  VarOrRVar shared = lane;
  for (int s = 0; s < block->stage_count(); ++s) {
    std::vector<VarOrRVar> order = cut_tile(block, s, tile, lanes);
    append_reduction(order, *block, s);
    const size_t inside = order.size();
    if (has_lanes) order.emplace_back(lane);
    append_others(order, *block, s);
    Stage(block, s).reorder(order);
    shared = order[inside];
  }
  Stage(block, 1).compute_with(Stage(block, 0), shared);  // sums start in registers
  // A register holds half as many sums in double.
  std::vector<VarOrRVar> order = cut_tile(sums, 1, tile, lanes / 2);
  if (has_lanes) order.emplace_back(lane);
  order.insert(order.end(), between.begin(), between.end());
  append_reduction(order, *sums, 1);
  const size_t inside = order.size();
  order.emplace_back(Var(tile.row));
  for (const NamedTile::Side& side : tile.sides) order.emplace_back(Var(side.name));
  append_others(order, *sums, 1);
  Stage(sums, 1).reorder(order);
  store_rows_along(sums, tile.row);
  store_rows_along(block, tile.row);
  copy_operands(block, turned, lanes);
  return {order.begin() + static_cast<long>(inside), order.end()};
}

std::vector<VarOrRVar> give_turned_loops(const FuncPtr& sums, const TurnedSum& turned,
                                         const std::vector<RVar>& terms, int lanes) {
  const NamedTile tile(*sums, turned, lanes);
  std::vector<VarOrRVar> result;
  for (int s = 0; s < sums->stage_count(); ++s) {
    std::vector<VarOrRVar> order = cut_tile(sums, s, tile, lanes);
    if (s > 0) order.insert(order.end(), terms.begin(), terms.end());
    const size_t inside = order.size();
    for (const size_t d : turned.outside) {
      if (is_pure_position(*sums, sums->stage(s), d)) order.emplace_back(Var(sums->args[d]));
    }
    Stage(sums, s).reorder(order);
    result.assign(order.begin() + static_cast<long>(inside), order.end());
  }
  store_rows_along(sums, tile.row);
  copy_operands(sums, turned, lanes);
  return result;
}

void add_turned_sums(const FuncPtr& f, int index, size_t dimension, int lanes) {
  const Var row(f->args[dimension]), vector(inner_loop(*f, index, row.name()));
  Stage stage(f, index);
  stage.split(row, row, vector, lanes, TailStrategy::GuardWithIf).vectorize(vector);
  std::vector<VarOrRVar> order{vector};
  for (size_t d = 0; d < f->args.size(); ++d) {
    if (d != dimension && is_pure_position(*f, f->stage(index), d))
      order.emplace_back(Var(f->args[d]));
  }
  order.emplace_back(row);
  stage.reorder(order);
  for (size_t i = order.size() - 1; i > 0 && i + 2 >= order.size(); --i) stage.parallel(order[i]);
}

bool add_turned_lanes(const FuncPtr& f, int index, int lanes) {
  if (index == 0 || !f->made || f->made->role != graph::Role::Accumulator) return false;
  const auto dimension = row_of_turned_lanes(*f, f->stage(index));
  if (!dimension || *dimension == 0 || innermost_is_moved(*f)) return false;
  const Var row(f->args[*dimension]);
  store_rows_along(f, row.name());
  Stage stage(f, index);
  const Var vector(inner_loop(*f, index, row.name()));
  stage.split(row, row, vector, lanes / 2, TailStrategy::GuardWithIf).vectorize(vector);
  std::vector<VarOrRVar> order{vector};
  for (const ReductionVariable& r : f->stage(index).rvars) order.emplace_back(RVar(r.var));
  order.emplace_back(row);
  append_others(order, *f, index);
  stage.reorder(order).parallel(order.back());
  return true;
}

}  // namespace retrograde::autoschedule
