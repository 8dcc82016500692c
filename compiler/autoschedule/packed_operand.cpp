#include "autoschedule/packed_operand.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "analysis/linear.h"
#include "autoschedule/loop_order.h"
#include "autoschedule/machine/reference.h"
#include "autoschedule/new_loop.h"
#include "autoschedule/read_estimate.h"
#include "autoschedule/reduction_chunks.h"
#include "graph/definitions/own_reads.h"
#include "graph/directives/give_directive.h"
#include "graph/directives/wrappers.h"
#include "ir/build.h"
#include "ir/lets.h"
#include "ir/visit.h"
#include "simplify/simplify.h"

namespace retrograde::autoschedule {

namespace {

constexpr int64_t most_elements = planning::second_cache_bytes / 64;  // of a copy
constexpr int64_t many_rows = planning::first_cache_ways;
constexpr double least_uses = 4;        // of an element of the copy
constexpr int64_t least_block = 64;     // iterations: sums are fetched and put back for each
constexpr int64_t most_rows = 8;        // of tiles that share a copy
constexpr double worth_sharing = 0.75;  // of what is copied for each alone
constexpr double least_tiles = 8;       // that use one copy: with fewer, its rows stay in the cache
constexpr int64_t most_of_whole = planning::second_cache_bytes / 4;  // elements of a copy of all
constexpr double least_uses_of_whole = 64;                           // of an element of such a copy

// How far each loop of a tile runs.
using Extents = std::unordered_map<std::string, int64_t>;

// nullopt: a loop of the reduction has no constant extent.
std::optional<Extents> extents_of(const FuncContents& f, const Definition& update,
                                  const RegisterTile& tile, int lanes) {
  Extents extents;
  for (size_t d = 0; d < f.args.size(); ++d) extents[f.args[d]] = tile.size_along(d, lanes);
  for (const ReductionVariable& r : update.rvars) {
    const auto extent = as_const_int(simplify(r.extent));
    if (!extent || *extent <= 0) return std::nullopt;
    extents[r.var] = *extent;
  }
  return extents;
}

// The values that an index takes in a tile; nullopt: it is not linear.
std::optional<int64_t> span_of(const Expr& index, const Extents& extents) {
  std::vector<std::string> names;
  for (const auto& [name, extent] : extents) names.push_back(name);
  const auto form = decompose(index, names);
  if (!form || any_node(form->rest, [](const Call&) { return true; })) return std::nullopt;
  int64_t span = 1;
  for (const auto& [name, coefficient] : form->coefficients)
    span += std::abs(coefficient) * (extents.at(name) - 1);
  return span;
}

class Candidate {
 public:
  Candidate(const Call& call, const FuncContents& f, const Definition& update,
            const RegisterTile& tile, int lanes, const SizeEstimate& sizes, const Extents& extents)
      : f_(f),
        update_(update),
        tile_(tile),
        lanes_(lanes),
        sizes_(sizes),
        extents_(extents),
        row_(innermost_dimension(call)) {
    for (const Expr& arg : call.args) index_.push_back(place(arg));
    for (const std::string& arg : f.args) depends_on_.push_back(moves(arg));
  }

  bool is_worth_packing() const {
    const auto lanes_along = lane_dimension();
    const auto elements = lanes_along ? elements_of_piece() : std::nullopt;
    if (!elements || !has_tasks()) return false;
    // Lanes that run across rows are loaded one by one, wherever they lie.
    const bool is_near =
        *lanes_along == row_ &&
        (rows() < many_rows || tiles(false) < least_tiles || lies_together_already());
    return !is_near &&
           loads_of_a_tile() * tiles(false) * lanes_ >= least_uses * static_cast<double>(*elements);
  }
  bool fits() const { return elements_of_piece().has_value(); }
  // Whether lanes across rows are worth a transposed copy of all that is read, if tiles that move it are few tasks.
  bool is_worth_packing_whole() const {
    const auto along = lane_dimension();
    if (!along || *along == row_ ||
        tiles(true) >= static_cast<double>(sizes_.machine().enough_tasks()))
      return false;
    Extents all = extents_;
    double uses = 1;
    for (size_t d = 0; d < f_.args.size(); ++d) {
      const auto extent = sizes_.extent(f_, d);
      if (!extent) return false;
      all[f_.args[d]] = *extent;
      uses *= depends_on_[d] ? 1 : static_cast<double>(*extent);
    }
    return uses >= least_uses_of_whole && Candidate(*this, all).elements_of_piece(most_of_whole);
  }
  // The dimension and count of tiles that leave the least to copy for each of them.
  std::optional<PackedOperand::Rows> rows_that_share() const {
    const auto alone = elements_of_piece();
    std::optional<PackedOperand::Rows> best;
    double least = static_cast<double>(alone.value_or(0)) * worth_sharing;
    for (size_t d = 1; alone && d < f_.args.size(); ++d) {
      const auto extent = sizes_.extent(f_, d);
      if (!depends_on_[d] || tile_.size_along(d, lanes_) != 1 || !extent) continue;
      for (int64_t count = 2; count <= most_rows && *extent % count == 0; count *= 2) {
        Extents together = extents_;
        together[f_.args[d]] = count;
        const auto elements = Candidate(*this, together).elements_of_piece();
        const double each =
            elements ? static_cast<double>(*elements) / static_cast<double>(count) : least;
        const bool is_small = elements && *elements <= most_elements / 2;
        const bool leaves_tasks =
            tiles(true) >= static_cast<double>(count * sizes_.machine().enough_tasks());
        if (!is_small || !leaves_tasks || each >= least) continue;
        best = PackedOperand::Rows{d, count};
        least = each;
      }
    }
    return best;
  }
  const std::vector<bool>& depends_on() const { return depends_on_; }
  // The index, one and no other, that is the next for the next lane.
  std::optional<size_t> lane_dimension() const {
    std::optional<size_t> found;
    for (size_t d = 0; d < index_.size(); ++d) {
      const auto form = decompose(index_[d], {f_.args[0]});
      const int64_t step = form ? form->coefficients[0].second : 2;
      if (step != 0 && (step != 1 || found)) return std::nullopt;
      if (step == 1) found = d;
    }
    return found;
  }

 private:
  // The same read, in other loops.
  Candidate(const Candidate& other, const Extents& extents)
      : f_(other.f_),
        update_(other.update_),
        tile_(other.tile_),
        lanes_(other.lanes_),
        sizes_(other.sizes_),
        extents_(extents),
        row_(other.row_),
        index_(other.index_),
        depends_on_(other.depends_on_) {}

  Expr place(const Expr& arg) const {
    return unclamped(without_lets(arg), [&](const Expr& e) {
      return std::any_of(extents_.begin(), extents_.end(),
                         [&](const auto& loop) { return uses_variable(e, loop.first); });
    });
  }
  bool moves(const std::string& var) const {
    return std::any_of(index_.begin(), index_.end(),
                       [&](const Expr& e) { return uses_variable(e, var); });
  }

  std::optional<int64_t> elements_of_piece(int64_t most = most_elements) const {
    int64_t elements = 1;
    for (const Expr& index : index_) {
      const auto span = span_of(index, extents_);
      if (!span || *span > most) return std::nullopt;
      elements *= *span;
      if (elements > most) return std::nullopt;
    }
    return elements;
  }

  // Whole rows, one after the other.
  bool lies_together_already() const {
    const auto width = sizes_.extent(f_, 0);
    const auto is_moved = [&](const Expr& index) {
      return std::any_of(update_.rvars.begin(), update_.rvars.end(),
                         [&](const ReductionVariable& r) { return uses_variable(index, r.var); });
    };
    return width && *width <= tile_.size_along(0, lanes_) && index_.size() > 1 && row_ == 0 &&
           !is_moved(index_[0]) && std::none_of(index_.begin() + 2, index_.end(), is_moved);
  }

  // That the reduction reads for one element of the tile.
  int64_t rows() const {
    int64_t rows = 1;
    for (const ReductionVariable& r : update_.rvars) {
      bool is_row = false;
      for (size_t d = 0; d < index_.size(); ++d)
        is_row |= d != row_ && uses_variable(index_[d], r.var);
      if (is_row) rows *= extents_.at(r.var);
    }
    return rows;
  }

  // Whether the loops that move the piece are tasks enough. Loops over tiles along rows are tasks only if there is no
  // other, or if the rows drive each other out of the caches.
  bool has_tasks() const {
    const auto enough = static_cast<double>(sizes_.machine().enough_tasks());
    const auto width = sizes_.extent(f_, 0);
    const bool meet =
        width && *width * f_.types[0].bytes() % planning::second_cache_set_stride == 0;
    return tiles(true) * (meet ? tiles_along(0) : 1) >= enough;
  }

  // Of vectors.
  double loads_of_a_tile() const {
    double loads = static_cast<double>(tile_.vectors);
    for (const ReductionVariable& r : update_.rvars)
      loads *= static_cast<double>(extents_.at(r.var));
    for (size_t d = 1; d < f_.args.size(); ++d)
      loads *= depends_on_[d] ? static_cast<double>(tile_.size_along(d, lanes_)) : 1;
    return loads;
  }

  // Along the dimensions that move the piece, whose loops are the tasks, of the first only where there
  // is no other; or along the others: so many use one.
  double tiles(bool that_move) const {
    const bool is_alone = std::count(depends_on_.begin(), depends_on_.end(), true) == 1;
    double tiles = 1;
    for (size_t d = that_move && is_alone ? 0 : 1; d < f_.args.size(); ++d) {
      if (depends_on_[d] == that_move) tiles *= tiles_along(d);
    }
    return tiles;
  }

  double tiles_along(size_t d) const {
    const auto size = static_cast<double>(tile_.size_along(d, lanes_));
    const double unknown =
        depends_on_[d] ? static_cast<double>(sizes_.machine().enough_tasks()) * size : 1;
    const auto extent = sizes_.extent(f_, d);
    return std::ceil((extent ? static_cast<double>(*extent) : unknown) / size);
  }

  const FuncContents& f_;
  const Definition& update_;
  const RegisterTile& tile_;
  const int lanes_;
  const SizeEstimate& sizes_;
  const Extents& extents_;
  const size_t row_;  // the index along which the source's rows lie in memory
  std::vector<Expr> index_;
  std::vector<bool> depends_on_;
};

// A Func that nobody has placed inside of another.
FuncPtr source_of(const Call& call, const FuncContents& f) {
  const FuncPtr source = call.call_type == CallType::Func ? func_of(call) : nullptr;
  if (!source || source.get() == &f || source->is_extern()) return nullptr;
  return source->schedule.compute_level.kind == graph::LoopLevel::Kind::At ? nullptr : source;
}

std::shared_ptr<graph::ParameterContents> image_of(const Call& call, const FuncContents& f) {
  if (call.call_type != CallType::Image || f.copied_inputs.contains(call.name)) return nullptr;
  return std::static_pointer_cast<graph::ParameterContents>(call.symbol.lock());
}

Func copy_for(const FuncPtr& f, const PackedOperand& operand) {
  if (operand.source) return Func(operand.source).in(Func(f));
  return Func(graph::copied_input(f, operand.image, operand.image->name + "_in_" + f->name));
}

// Lanes along the rows of the copy; where those are not the rows of the source, blocks of as many
// rows are loaded whole and turned in registers.
void schedule_copy(Func copy, size_t lane_dimension, int lanes) {
  const std::vector<Var> args = copy.args();
  const Var row = args[lane_dimension];
  if (lane_dimension != 0) {
    std::vector<Var> storage{row};
    for (const Var& arg : args) {
      if (!arg.same_as(row)) storage.push_back(arg);
    }
    copy.reorder_storage(storage);
    const Var in_block(inner_loop(*copy.function(), 0, args[0].name()));
    Stage(copy.function(), 0)
        .split(args[0], args[0], in_block, lanes, TailStrategy::GuardWithIf)
        .reorder(in_block, row)
        .unroll(in_block);
  }
  vectorize(Stage(copy.function(), 0), row, lanes, TailStrategy::GuardWithIf);
}

// Whether the lanes of a vector run across the rows of what is read.
bool has_lanes_across_rows(const Call& call, const FuncContents& f) {
  const size_t row = innermost_dimension(call);
  for (size_t d = 0; d < call.args.size(); ++d) {
    if (d != row && uses_variable(call.args[d], f.args[0])) return true;
  }
  return false;
}

// The piece of one tile. Where the copy of all of the reduction is too large: of as many iterations of the outermost
// loop as fit, and divide it.
std::optional<PackedOperand> packed_piece(const Call& call, const FuncContents& f,
                                          const Definition& update, const RegisterTile& tile,
                                          int lanes, const SizeEstimate& sizes, Extents extents) {
  const auto candidate = [&] { return Candidate(call, f, update, tile, lanes, sizes, extents); };
  PackedOperand result;
  const std::string loop = reduction_loops(f, update).back().var;
  const int64_t all = extents.at(loop);
  if (!candidate().lane_dimension()) return std::nullopt;
  while (!candidate().fits()) {
    const int64_t last = extents[loop];
    extents[loop] = largest_part(all, std::min(last - 1, most_elements));
    if (extents[loop] < least_block || extents[loop] == last) return std::nullopt;
    result.block = PackedOperand::Block{loop, extents[loop]};
  }
  if (!candidate().is_worth_packing()) return std::nullopt;
  result.lane_dimension = *candidate().lane_dimension();
  result.depends_on = candidate().depends_on();
  if (!result.block) result.rows = candidate().rows_that_share();
  return result;
}

std::optional<PackedOperand> packed_at_once(const Call& call, const FuncContents& f,
                                            const Definition& update, const RegisterTile& tile,
                                            int lanes, const SizeEstimate& sizes,
                                            const Extents& extents) {
  const Candidate candidate(call, f, update, tile, lanes, sizes, extents);
  if (!has_lanes_across_rows(call, f) || !candidate.is_worth_packing_whole()) return std::nullopt;
  PackedOperand whole;
  whole.lane_dimension = *candidate.lane_dimension();
  whole.depends_on = candidate.depends_on();
  whole.is_whole = true;
  return whole;
}

}  // namespace

std::optional<PackedOperand> packed_operand(const FuncContents& f, const Definition& update,
                                            const RegisterTile& tile, int lanes,
                                            const SizeEstimate& sizes) {
  const auto extents = extents_of(f, update, tile, lanes);
  if (!extents) return std::nullopt;
  std::unordered_map<std::string, int> reads;
  std::optional<PackedOperand> piece, whole;
  std::string packed, packed_whole;
  int across = 0;  // reads whose lanes are loaded one by one
  walk_definition(update, [&](const Expr& e) {
    const auto* call = e.as<Call>();
    if (!call) return;
    across += call->call_type != CallType::Operator && has_lanes_across_rows(*call, f);
    const FuncPtr source = source_of(*call, f);
    const auto image = image_of(*call, f);
    if (!source && !image) return;
    ++reads[call->name];
    const auto note = [&](std::optional<PackedOperand>& found, std::string& name,
                          const auto& find) {
      if (found) return;
      found = find(*call, f, update, tile, lanes, sizes, *extents);
      if (!found) return;
      found->source = source;
      found->image = image;
      name = call->name;
    };
    note(piece, packed, packed_piece);
    note(whole, packed_whole, packed_at_once);
  });
  // Of several reads the copy would hold what lies between them.
  if (piece) return reads[packed] == 1 ? piece : std::nullopt;
  return whole && across == 1 && reads[packed_whole] == 1 ? whole : std::nullopt;
}

std::optional<PackedOperand> whole_operand(const Call& call, const FuncContents& f,
                                           size_t lane_dimension) {
  PackedOperand whole;
  whole.source = source_of(call, f);
  whole.image = image_of(call, f);
  whole.lane_dimension = lane_dimension;
  whole.is_whole = true;
  return whole.source || whole.image ? std::optional(whole) : std::nullopt;
}

void pack(const FuncPtr& f, const PackedOperand& operand, const retrograde::LoopLevel& loop,
          int lanes) {
  Func copy = copy_for(f, operand);
  copy.compute_at(loop);
  schedule_copy(copy, operand.lane_dimension, lanes);
}

void pack_whole(const FuncPtr& f, const PackedOperand& operand, int lanes) {
  Func copy = copy_for(f, operand);
  copy.compute_root();
  schedule_copy(copy, operand.lane_dimension, lanes);
  const std::vector<Var> args = copy.args();
  copy.parallel(args.back());
  if (operand.lane_dimension + 1 < args.size() &&
      args.size() > 2)  // vectors are no loop around others
    copy.parallel(args[args.size() - 2]);
}

}  // namespace retrograde::autoschedule
