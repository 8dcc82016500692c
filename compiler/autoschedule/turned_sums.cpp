#include "autoschedule/turned_sums.h"

#include <algorithm>
#include <string>
#include <unordered_set>

#include "autoschedule/loop_order.h"
#include "autoschedule/new_loop.h"
#include "autoschedule/phase_loops.h"
#include "autoschedule/read_estimate.h"
#include "frontend/language/func.h"
#include "frontend/language/rdom.h"
#include "graph/definitions/own_reads.h"
#include "ir/build.h"
#include "ir/lets.h"
#include "ir/visit.h"

namespace retrograde::autoschedule {

namespace {

// Vectors of a tile, and elements along its side. Of fewer channels, vectors of strided terms are as fast.
constexpr int64_t most_vectors_of_tile = 4, least_vectors_of_tile = 3, rows_of_tile = 4;
constexpr double least_uses_of_copy = 64;  // of an element: products

bool moves(const Call& call, const std::string& variable) {
  return std::ranges::any_of(call.args,
                             [&](const Expr& index) { return uses_variable(index, variable); });
}

// What the update reads of others, each node once.
std::vector<const Call*> reads_of_block(const FuncContents& block) {
  std::vector<const Call*> result;
  std::unordered_set<const ExprNode*> seen;
  for (const Expr& value : block.updates[0].values) {
    walk(value, [&](const Expr& e) {
      if (!seen.insert(e.get()).second) return false;
      const auto* call = e.as<Call>();
      const bool loads = call && call->call_type != CallType::Operator;
      if (loads && call->name != block.name) result.push_back(call);
      return true;
    });
  }
  return result;
}

class Turner {
 public:
  Turner(const FuncContents& block, int lanes, const VectorUnit& unit, const SizeEstimate& sizes)
      : block_(block), lanes_(lanes), unit_(unit), sizes_(sizes), reads_(reads_of_block(block)) {
    dimensions_ = block.args.size() - static_cast<size_t>(block.made->blocks);
  }

  std::optional<TurnedSum> find() const {
    std::optional<TurnedSum> best;
    if (std::ranges::none_of(reads_, [&](const Call* call) { return stride(*call) > 1; }))
      return best;
    for (size_t d = 1; d < dimensions_; ++d) {
      const auto found = along(d);
      if (found && (!best || found->vectors > best->vectors)) best = found;
    }
    return best;
  }

 private:
  // By how much the place in a row grows from lane to lane; 0: not at all, or not always by the same.
  int64_t stride(const Call& call) const {
    return call.args.empty() ? 0 : growth_of_index(call.args[0], block_.args[0], 1).value_or(0);
  }

  std::optional<TurnedSum> along(size_t d) const {
    const std::string& name = block_.args[d];
    const Call* read = nullptr;  // the only one that moves along it
    for (const Call* call : reads_) {
      if (!moves(*call, name)) continue;
      if (read) return std::nullopt;
      read = call;
    }
    const auto index = read ? index_along(*read, name) : std::nullopt;
    if (!index || stride(*read) > 1) return std::nullopt;
    const auto side = longest_side(*read, d);
    auto operand = side ? whole_operand(*read, block_, *index) : std::nullopt;
    if (!operand || uses(d) < least_uses_of_copy) return std::nullopt;
    TurnedSum result{d, *side, 1, 1, *std::move(operand)};
    return fit(result) ? std::optional(result) : std::nullopt;
  }

  // The index that is the variable; none of the others may have it. Rows of the source lie along the first.
  static std::optional<size_t> index_along(const Call& call, const std::string& name) {
    std::optional<size_t> result;
    for (size_t i = 0; i < call.args.size(); ++i) {
      if (!uses_variable(call.args[i], name)) continue;
      const Expr index = unclamped(without_lets(call.args[i]),
                                   [&](const Expr& e) { return uses_variable(e, name); });
      const auto* variable = index.as<Variable>();
      if (!variable || result || i == 0) return std::nullopt;
      result = i;
    }
    return result;
  }

  std::optional<size_t> longest_side(const Call& read, size_t d) const {
    std::optional<size_t> result;
    int64_t most = 0;
    for (size_t e = 1; e < dimensions_; ++e) {
      const int64_t extent = sizes_.extent(block_, e).value_or(0);
      if (e == d || moves(read, block_.args[e]) || extent % rows_of_tile != 0 || extent <= most)
        continue;
      result = e;
      most = extent;
    }
    return result;
  }

  // Products with an element of the copy: each term reads one for each element of the result along other dimensions.
  double uses(size_t d) const {
    double result = 1;
    for (size_t e = 1; e < dimensions_; ++e)
      result *= e == d ? 1 : static_cast<double>(sizes_.extent(block_, e).value_or(1));
    return result;
  }

  // The most vectors that the dimension is a multiple of, in registers.
  bool fit(TurnedSum& turned) const {
    const int64_t extent = sizes_.extent(block_, turned.dimension).value_or(0);
    const int64_t bytes = lanes_ * block_.types[0].bytes();
    for (int64_t vectors = most_vectors_of_tile; vectors >= least_vectors_of_tile; --vectors) {
      const bool fits = vectors * rows_of_tile * bytes <= unit_.accumulator_bytes;
      if (extent <= 0 || extent % (vectors * lanes_) != 0 || !fits) continue;
      turned.vectors = vectors;
      turned.side_size = rows_of_tile;
      return true;
    }
    return false;
  }

  const FuncContents& block_;
  const int lanes_;
  const VectorUnit& unit_;
  const SizeEstimate& sizes_;
  const std::vector<const Call*> reads_;
  size_t dimensions_ = 0;  // of the block, without the numbers
};

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

// The loops of a stage over a tile: vectors of so many lanes along the row, then its rows. What is outside of the tile
// along these keeps the names.
std::vector<VarOrRVar> cut_tile(const FuncPtr& f, int index, const Var& row, int64_t row_size,
                                const Var& side, int64_t side_size, int lanes) {
  Stage stage(f, index);
  const Var in_row(inner_loop(*f, index, row.name()));
  stage.split(row, row, in_row, static_cast<int>(row_size), TailStrategy::GuardWithIf);
  const Var vector(new_loop(*f, index, "vector"));
  stage.split(in_row, in_row, vector, lanes, TailStrategy::GuardWithIf);
  const Var in_side(inner_loop(*f, index, side.name()));
  stage.split(side, side, in_side, static_cast<int>(side_size), TailStrategy::GuardWithIf);
  stage.vectorize(vector).unroll(in_row).unroll(in_side);
  return {vector, in_row, in_side};
}

// Appends the loops over dimensions that the order lacks. An update has none over those whose places are fixed.
void append_others(std::vector<VarOrRVar>& order, const FuncContents& f, int index) {
  for (size_t d = 0; d < f.args.size(); ++d) {
    const auto is_it = [&](const VarOrRVar& loop) { return loop.name() == f.args[d]; };
    if (is_pure_position(f, f.stage(index), d) && std::ranges::none_of(order, is_it))
      order.emplace_back(Var(f.args[d]));
  }
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

RegisterTile TurnedSum::tile(int lanes) const {
  return {1, {{dimension, vectors * lanes}, {side, side_size}}};
}

std::optional<TurnedSum> turned_sum(const FuncContents& block, int lanes, const VectorUnit& unit,
                                    const SizeEstimate& sizes) {
  const bool has_lanes = block.made && block.made->lanes == lanes && !block.made->has_parts;
  if (!has_lanes || block.updates.size() != 1 || block.types.size() != 1) return std::nullopt;
  return Turner(block, lanes, unit, sizes).find();
}

std::vector<VarOrRVar> give_turned_loops(const FuncPtr& sums, const FuncPtr& block,
                                         const TurnedSum& turned, const std::vector<Var>& between,
                                         int lanes) {
  const Var row(block->args[turned.dimension]), side(block->args[turned.side]);
  const Var lane(block->args[0]);
  const int64_t row_size = turned.vectors * lanes;
  for (int s = 0; s < block->stage_count(); ++s) {
    std::vector<VarOrRVar> order = cut_tile(block, s, row, row_size, side, turned.side_size, lanes);
    for (const ReductionVariable& r : reduction_loops(*block, block->stage(s)))
      order.emplace_back(RVar(r.var));
    order.emplace_back(lane);
    append_others(order, *block, s);
    Stage(block, s).reorder(order);
  }
  Stage(block, 1).compute_with(Stage(block, 0), lane);  // sums start in registers
  // A register holds half as many sums in double.
  std::vector<VarOrRVar> order =
      cut_tile(sums, 1, row, row_size, side, turned.side_size, lanes / 2);
  order.emplace_back(lane);
  order.insert(order.end(), between.begin(), between.end());
  for (const ReductionVariable& r : reduction_loops(*sums, sums->updates[0]))
    order.emplace_back(RVar(r.var));
  const size_t inside = order.size();
  order.emplace_back(row);
  order.emplace_back(side);
  append_others(order, *sums, 1);
  Stage(sums, 1).reorder(order);
  store_rows_along(sums, row.name());
  store_rows_along(block, row.name());
  pack_whole(block, turned.operand, lanes);
  return {order.begin() + static_cast<long>(inside), order.end()};
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
