#include "autoschedule/turned_sums.h"

#include <algorithm>
#include <string>
#include <unordered_set>

#include "analysis/linear.h"
#include "autoschedule/long_sums.h"
#include "autoschedule/machine/reference.h"
#include "autoschedule/phase_loops.h"
#include "autoschedule/read_estimate.h"
#include "graph/definitions/own_reads.h"
#include "ir/build.h"
#include "ir/lets.h"
#include "ir/visit.h"
#include "simplify/simplify.h"

namespace retrograde::autoschedule {

namespace {

// Vectors of a tile, and elements along its side. Of fewer channels, vectors of strided terms are as fast.
constexpr int64_t most_vectors_of_tile = 4, least_vectors_of_tile = 3, rows_of_tile = 4;
constexpr double least_uses_of_copy = 64;  // of an element: products
constexpr double few_uses = 16;            // that pay where vectors would be nearly empty
constexpr int64_t most_rows = 8;           // of a side, without private lanes
constexpr int64_t least_terms = 63,
                  least_terms_of_block = 15;  // more are added without private lanes
constexpr double least_products =
    2 * planning::launch_operations;   // of all of these sums: copies are loops of their own
constexpr double far_loads = 2;        // for a vector that comes from a far cache
constexpr double worth_turning = 1;    // cycles for a product of a register
constexpr double least_filled = 0.75;  // of the elements of tiles

bool moves(const Call& call, const std::string& variable) {
  return std::ranges::any_of(call.args,
                             [&](const Expr& index) { return uses_variable(index, variable); });
}

// What the update reads of others, each node once.
std::vector<const Call*> reads_of(const FuncContents& sums, const Definition& update) {
  std::vector<const Call*> result;
  std::unordered_set<const ExprNode*> seen;
  for (const Expr& value : update.values) {
    walk(value, [&](const Expr& e) {
      if (!seen.insert(e.get()).second) return false;
      const auto* call = e.as<Call>();
      const bool loads = call && call->call_type != CallType::Operator;
      if (loads && call->name != sums.name) result.push_back(call);
      return true;
    });
  }
  return result;
}

// The index that is the variable; none of the others may have it.
std::optional<size_t> index_along(const Call& call, const std::string& name) {
  std::optional<size_t> result;
  for (size_t i = 0; i < call.args.size(); ++i) {
    if (!uses_variable(call.args[i], name)) continue;
    const Expr index = unclamped(without_lets(call.args[i]),
                                 [&](const Expr& e) { return uses_variable(e, name); });
    const auto* variable = index.as<Variable>();
    if (!variable || result) return std::nullopt;
    result = i;
  }
  return result;
}

// Of the dimensions of the sums, without the numbers of blocks.
class Operands {
 public:
  Operands(const FuncContents& sums, const Definition& update, const SizeEstimate& sizes)
      : sums_(sums), update_(update), sizes_(sizes), reads_(reads_of(sums, update)) {
    dimensions_ = sums.args.size() - static_cast<size_t>(sums.made ? sums.made->blocks : 0);
  }

  size_t dimensions() const { return dimensions_; }
  const std::vector<const Call*>& reads() const { return reads_; }
  const std::string& name(size_t d) const { return sums_.args[d]; }
  int64_t extent(size_t d) const { return sizes_.extent(sums_, d).value_or(0); }  // 0: not known

  // The only read that moves along the dimension; null: there are several.
  const Call* only_read_along(size_t d) const {
    const Call* read = nullptr;
    for (const Call* call : reads_) {
      if (!moves(*call, name(d))) continue;
      if (read) return nullptr;
      read = call;
    }
    return read;
  }
  // Whether no other read is of the same source, so that a copy would hold no more than this one.
  bool is_alone(const Call& read) const {
    return std::ranges::count(reads_, read.name, [](const Call* call) { return call->name; }) == 1;
  }
  // Of all sums, of a block if there are blocks; 0: not known.
  double products() const {
    double result = static_cast<double>(terms());
    for (size_t d = 0; d < dimensions_; ++d) {  // the numbers of blocks are left out
      if (is_pure_position(sums_, update_, d)) result *= static_cast<double>(extent(d));
    }
    return result;
  }
  // Of a sum; 0: not known.
  int64_t terms() const {
    int64_t result = 1;
    for (const ReductionVariable& r : update_.rvars) result *= extent_of(r);
    return result;
  }
  // Products with an element of what is read; 0: not known. A variable inside of a quotient or remainder counts as a
  // stride of one.
  double uses(const Call& call) const {
    double elements = 1;
    for (const Expr& arg : call.args) {
      double span = 1;
      const auto add = [&](const std::string& name, int64_t extent) {
        const auto moves = [&](const Expr& e) { return uses_variable(e, name); };
        if (!moves(arg)) return;
        const auto form = analysis::decompose(unclamped(without_lets(arg), moves), {name});
        const int64_t stride = form ? std::abs(form->coefficients[0].second) : 1;
        span += static_cast<double>(stride * std::max<int64_t>(extent - 1, 0));
      };
      for (size_t d = 0; d < dimensions_; ++d) {
        if (is_pure_position(sums_, update_, d)) add(name(d), extent(d));
      }
      for (const ReductionVariable& r : update_.rvars) add(r.var, extent_of(r));
      elements *= span;
    }
    return products() / elements;
  }

 private:
  static int64_t extent_of(const ReductionVariable& r) {
    return std::max<int64_t>(as_const_int(simplify(r.extent)).value_or(0), 0);
  }

  const FuncContents& sums_;
  const Definition& update_;
  const SizeEstimate& sizes_;
  const std::vector<const Call*> reads_;
  size_t dimensions_ = 0;
};

// Of private sums in lanes of strided terms.
class LaneTurner {
 public:
  LaneTurner(const FuncContents& block, int lanes, const planning::Machine& machine,
             const SizeEstimate& sizes)
      : block_(block),
        lanes_(lanes),
        machine_(machine),
        operands_(block, block.updates[0], sizes) {}

  std::optional<TurnedSum> find() const {
    std::optional<TurnedSum> best;
    if (std::ranges::none_of(operands_.reads(),
                             [&](const Call* call) { return stride(*call) > 1; }))
      return best;
    for (size_t d = 1; d < operands_.dimensions(); ++d) {
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
    const Call* read = operands_.only_read_along(d);
    const auto index = read ? index_along(*read, operands_.name(d)) : std::nullopt;
    // Rows of the source lie along its first dimension.
    if (!index || *index == 0 || stride(*read) > 1) return std::nullopt;
    const auto side = longest_side(*read, d);
    auto operand = side ? whole_operand(*read, block_, *index) : std::nullopt;
    if (!operand || uses(d) < least_uses_of_copy) return std::nullopt;
    TurnedSum result{d, 1, {{*side, 1}}, {*std::move(operand)}};
    return fit(result) ? std::optional(result) : std::nullopt;
  }

  std::optional<size_t> longest_side(const Call& read, size_t d) const {
    std::optional<size_t> result;
    int64_t most = 0;
    for (size_t e = 1; e < operands_.dimensions(); ++e) {
      const int64_t extent = operands_.extent(e);
      const bool is_side = e != d && !moves(read, operands_.name(e)) && extent % rows_of_tile == 0;
      if (!is_side || extent <= most) continue;
      result = e;
      most = extent;
    }
    return result;
  }

  // Products with an element of the copy: each term reads one for each element of the result along other dimensions.
  double uses(size_t d) const {
    double result = 1;
    for (size_t e = 1; e < operands_.dimensions(); ++e)
      result *= e == d ? 1 : static_cast<double>(std::max<int64_t>(operands_.extent(e), 1));
    return result;
  }

  // The most vectors that the dimension is a multiple of, in registers.
  bool fit(TurnedSum& turned) const {
    const int64_t extent = operands_.extent(turned.dimension);
    const int64_t bytes = lanes_ * block_.types[0].bytes();
    for (int64_t vectors = most_vectors_of_tile; vectors >= least_vectors_of_tile; --vectors) {
      const bool fits = vectors * rows_of_tile * bytes <= machine_.accumulator_bytes();
      if (extent <= 0 || extent % (vectors * lanes_) != 0 || !fits) continue;
      turned.vectors = vectors;
      turned.sides[0].size = rows_of_tile;
      return true;
    }
    return false;
  }

  const FuncContents& block_;
  const int lanes_;
  const planning::Machine& machine_;
  const Operands operands_;
};

// Of sums without private lanes: the dimension and tile with the fewest cycles for each product.
class SumTurner {
 public:
  SumTurner(const FuncContents& sums, const Definition& update, int lanes,
            const planning::Machine& machine, const SizeEstimate& sizes)
      : sums_(sums),
        update_(update),
        lanes_(lanes),
        machine_(machine),
        operands_(sums, update, sizes) {
    const auto bytes = static_cast<double>(lanes * sums.types[0].bytes());
    find_bound_dimensions();
    registers_ = std::max(1.0, bytes / static_cast<double>(machine.vector_bytes));
  }

  // Whether there are many products, under conditions that load nothing.
  bool is_worth_copying() const {
    const bool is_block = sums_.made && sums_.made->blocks > 0;
    const bool loads =
        update_.predicate.defined() && any_node(update_.predicate, [](const Call& call) {
          return call.call_type != CallType::Operator;
        });
    return !loads && (is_block || operands_.products() >= least_products);
  }
  std::optional<TurnedSum> find() {
    for (size_t d = 0; d < operands_.dimensions(); ++d) {
      if (is_free(d)) consider(d);
    }
    if (!best_) return std::nullopt;
    add_copies();
    order_tiles();
    return best_;
  }

 private:
  // In the order in which they are compared.
  struct Cost {
    double cycles, loads;  // for each product of a register
    auto operator<=>(const Cost&) const = default;
  };

  // Conditions that use a dimension together with another one or with terms stay outside of tiles.
  void find_bound_dimensions() {
    std::vector<Expr> conditions;
    add_conjuncts(update_.predicate, conditions);
    is_bound_.assign(operands_.dimensions(), false);
    for (const Expr& condition : conditions) {
      std::vector<size_t> used;
      for (size_t d = 0; d < operands_.dimensions(); ++d) {
        if (uses_variable(condition, operands_.name(d))) used.push_back(d);
      }
      const bool uses_terms = std::ranges::any_of(
          update_.rvars, [&](const auto& r) { return uses_variable(condition, r.var); });
      for (const size_t d : used) is_bound_[d] = is_bound_[d] || uses_terms || used.size() > 1;
    }
  }
  bool is_free(size_t d) const { return is_pure_position(sums_, update_, d) && !is_bound_[d]; }

  void consider(size_t d) {
    const Call* read = operands_.only_read_along(d);
    const auto index = read ? index_along(*read, operands_.name(d)) : std::nullopt;
    if (!index || operands_.extent(d) < lanes_ || !operands_.is_alone(*read)) return;
    auto copy = whole_operand(*read, sums_, *index);
    if (!copy || operands_.uses(*read) < few_uses) return;
    std::vector<size_t> sides;
    for (size_t e = 0; e < operands_.dimensions(); ++e) {
      const bool is_moved = e == d || moves(*read, operands_.name(e));
      if (!is_moved && is_free(e) && operands_.extent(e) > 1) sides.push_back(e);
    }
    for (int64_t vectors = 1; vectors <= most_vectors_of_tile; ++vectors) {
      for (size_t i = 0; i < sides.size(); ++i) {
        for (int64_t a = 2; a <= rows_along(sides[i]); ++a) {
          compare({d, vectors, {{sides[i], a}}, {*copy}}, *read);
          for (size_t k = i + 1; k < sides.size(); ++k) {
            for (int64_t b = 2; b <= rows_along(sides[k]); ++b)
              compare({d, vectors, {{sides[i], a}, {sides[k], b}}, {*copy}}, *read);
          }
        }
      }
    }
  }
  int64_t rows_along(size_t d) const { return std::min(operands_.extent(d), most_rows); }

  void compare(const TurnedSum& tile, const Call& read) {
    int64_t sums = tile.vectors;
    double filled = share_of_tiles(tile.dimension, tile.vectors * lanes_);
    for (const RegisterTile::Side& side : tile.sides) {
      sums *= side.size;
      filled *= share_of_tiles(side.dimension, side.size);
    }
    const int64_t bytes = sums * lanes_ * sums_.types[0].bytes();
    if (bytes > machine_.accumulator_bytes() || filled < least_filled) return;
    const double products = static_cast<double>(sums) * registers_;
    double loads = far_loads * static_cast<double>(tile.vectors) * registers_;
    for (const Call* other : operands_.reads()) {
      if (other == &read) continue;
      double elements = 1;
      for (const RegisterTile::Side& side : tile.sides) {
        if (moves(*other, operands_.name(side.dimension)))
          elements *= static_cast<double>(side.size);
      }
      loads += elements;
    }
    const Cost cost{
        std::max({loads / products / planning::core.loads_per_cycle,
                  1 / planning::core.products_per_cycle, planning::core.float_latency / products}) /
            filled,
        loads / products};
    if (cost.cycles > worth_turning || (best_ && !(cost < least_))) return;
    best_ = tile;
    least_ = cost;
    read_ = &read;
  }
  double share_of_tiles(size_t d, int64_t size) const {
    const int64_t extent = operands_.extent(d);
    return static_cast<double>(extent) / static_cast<double>((extent + size - 1) / size * size);
  }

  // The vectors' operand stays in a cache while all else runs, of which the longest loop, for tasks, is the outermost.
  void order_tiles() {
    const auto tiles = [&](size_t d) {
      if (d == best_->dimension) return INT64_MAX;
      const auto side = std::ranges::find(best_->sides, d, &RegisterTile::Side::dimension);
      const int64_t size = side == best_->sides.end() ? 1 : side->size;
      return (operands_.extent(d) + size - 1) / size;
    };
    for (size_t d = 0; d < operands_.dimensions(); ++d) best_->outside.push_back(d);
    std::ranges::stable_sort(best_->outside, {}, tiles);
  }

  // Operands of which single elements are read, with what a tile reads at once next to each other.
  void add_copies() {
    for (const Call* call : operands_.reads()) {
      if (call == read_ || !operands_.is_alone(*call) || operands_.uses(*call) < few_uses) continue;
      size_t row = 0;
      for (const RegisterTile::Side& side : best_->sides) {
        if (const auto index = index_along(*call, operands_.name(side.dimension))) row = *index;
      }
      if (auto copy = whole_operand(*call, sums_, row)) best_->copies.push_back(*std::move(copy));
    }
  }

  const FuncContents& sums_;
  const Definition& update_;
  const int lanes_;
  const planning::Machine& machine_;
  const Operands operands_;
  std::vector<bool> is_bound_;  // by dimension
  double registers_ = 1;        // of a vector
  std::optional<TurnedSum> best_;
  Cost least_{};
  const Call* read_ = nullptr;  // by vectors of the best
};

}  // namespace

RegisterTile TurnedSum::tile(int lanes) const {
  RegisterTile result{1, {{dimension, vectors * lanes}}};
  result.sides.insert(result.sides.end(), sides.begin(), sides.end());
  return result;
}

std::optional<TurnedSum> turned_lanes(const FuncContents& block, int lanes,
                                      const planning::Machine& machine, const SizeEstimate& sizes) {
  const bool has_lanes = block.made && block.made->lanes == lanes && !block.made->has_parts;
  if (!has_lanes || block.updates.size() != 1 || block.types.size() != 1) return std::nullopt;
  return LaneTurner(block, lanes, machine, sizes).find();
}

std::optional<TurnedSum> turned_sum(const FuncContents& sums, const Definition& update, int lanes,
                                    const planning::Machine& machine, const SizeEstimate& sizes) {
  const bool is_block = sums.made && sums.made->blocks > 0;
  const bool is_plain = !sums.made || (sums.made->lanes == 0 && !sums.made->has_parts);
  if (!is_plain || sums.types.size() != 1 || sums.types[0] != Float(32) ||
      !is_long_sum(sums, update, update.rvars, 1, is_block ? least_terms_of_block : least_terms))
    return std::nullopt;
  SumTurner turner(sums, update, lanes, machine, sizes);
  return turner.is_worth_copying() ? turner.find() : std::nullopt;
}

}  // namespace retrograde::autoschedule
