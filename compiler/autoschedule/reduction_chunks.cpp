#include "autoschedule/reduction_chunks.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <unordered_map>
#include <vector>

#include "analysis/linear.h"
#include "autoschedule/loop_order.h"
#include "autoschedule/machine/reference.h"
#include "autoschedule/read_estimate.h"
#include "graph/definitions/own_reads.h"
#include "ir/build.h"
#include "ir/lets.h"
#include "ir/visit.h"
#include "simplify/simplify.h"

namespace retrograde::autoschedule {

namespace {

// For all tiles, as much as a second-level cache holds: those that a thread is at read a part of it.
constexpr double chunk_bytes = planning::second_cache_bytes;
constexpr double worth_a_chunk = 3;  // times as many bytes without: sums are read and written
constexpr double near_bytes = chunk_bytes / 2;  // of a chunk that stays there beside the sums
constexpr int64_t least_terms = 64;             // of a chunk: its tiles load and store their sums

// What one Func or image is read of.
struct ChunkOperand {
  double bytes = 0;           // for all tiles
  std::vector<bool> depends;  // on the dimensions of the sums
};

using Iterations = std::unordered_map<std::string, int64_t>;  // by the loop

// What all blocks of a chunk read, or what the sums themselves read.
class ChunkReads {
 public:
  // `iterations`: of a chunk, along arguments of the block and loops of its reduction; others run whole.
  ChunkReads(const FuncContents& sums, const FuncContents& block, const Iterations& iterations,
             const SizeEstimate& sizes)
      : sums_(sums), block_(block), extents_(iterations) {
    for (size_t d = 0; d < sums.args.size(); ++d) add(sums.args[d], sizes.extent(sums, d));
    for (const ReductionVariable& r : block.updates[0].rvars) {
      if (!iterations.contains(r.var)) add(r.var, as_const_int(simplify(r.extent)));
    }
    for (const auto& [name, extent] : extents_) names_.push_back(name);
  }

  // nullopt: some of it is not known, or not linear.
  std::optional<std::vector<ChunkOperand>> operands() const {
    std::vector<ChunkOperand> result;
    bool is_linear = is_known_;
    walk_definition(block_.updates[0], [&](const Expr& e) {
      const auto* call = e.as<Call>();
      const bool loads =
          call && (call->call_type == CallType::Func || call->call_type == CallType::Image);
      if (!loads || call->name == block_.name) return;  // or a copy of it
      const auto operand = operand_of(*call, e.type());
      is_linear &= operand.has_value();
      if (operand) result.push_back(*operand);
    });
    return is_linear ? std::optional(result) : std::nullopt;
  }

 private:
  void add(const std::string& name, std::optional<int64_t> extent) {
    is_known_ &= extent.has_value();
    extents_[name] = extent.value_or(1);
  }

  std::optional<ChunkOperand> operand_of(const Call& call, const Type& type) const {
    ChunkOperand operand{static_cast<double>(type.bytes()),
                         std::vector<bool>(sums_.args.size(), false)};
    for (const Expr& arg : call.args) {
      const auto span = span_of(arg);
      if (!span) return std::nullopt;
      operand.bytes *= *span;
      for (size_t d = 0; d < sums_.args.size(); ++d)
        operand.depends[d] = operand.depends[d] || uses_variable(arg, sums_.args[d]);
    }
    return operand;
  }

  std::optional<double> span_of(const Expr& arg) const {
    const auto is_moved_by = [](const Expr& e, const std::vector<std::string>& names) {
      return std::any_of(names.begin(), names.end(),
                         [&](const std::string& name) { return uses_variable(e, name); });
    };
    const Expr index = unclamped(without_lets(arg), [&](const Expr& e) {
      return is_moved_by(e, block_.args) || is_moved_by(e, names_);
    });
    const auto form = decompose(index, names_);
    if (!form || any_node(form->rest, [](const Call&) { return true; })) return std::nullopt;
    double span = 1;
    for (const auto& [name, step] : form->coefficients)
      span += std::abs(static_cast<double>(step)) * static_cast<double>(extents_.at(name) - 1);
    return span;
  }

  const FuncContents& sums_;
  const FuncContents& block_;
  Iterations extents_;
  std::vector<std::string> names_;
  bool is_known_ = true;
};

double tiles_along(const FuncContents& sums, size_t d, const RegisterTile& tile, int lanes,
                   const SizeEstimate& sizes) {
  const int64_t size = tile.size_along(d, lanes);
  const int64_t extent = sizes.extent(sums, d).value_or(1);
  return std::ceil(static_cast<double>(extent) / static_cast<double>(size));
}

// Of a chunk: once, and as often as tiles read it.
struct ChunkBytes {
  double once = 0, by_tiles = 0;
};

ChunkBytes bytes_of(const std::vector<ChunkOperand>& operands, const FuncContents& sums,
                    const RegisterTile& tile, int lanes, const SizeEstimate& sizes) {
  ChunkBytes bytes;
  for (const ChunkOperand& operand : operands) {
    double readers = 1;
    for (size_t d = 0; d < sums.args.size(); ++d)
      readers *= operand.depends[d] ? 1 : tiles_along(sums, d, tile, lanes, sizes);
    bytes.once += operand.bytes;
    bytes.by_tiles += operand.bytes * readers;
  }
  return bytes;
}

}  // namespace

std::optional<size_t> number_along(const FuncContents& sums, const FuncContents& block,
                                   const std::string& loop) {
  std::optional<size_t> result;
  walk_definition(sums.updates[0], [&](const Expr& e) {
    const auto* call = e.as<Call>();
    if (!call || call->name != block.name) return;
    for (size_t d = 0; d < call->args.size(); ++d) {
      const auto* place = call->args[d].as<Variable>();
      if (place && place->name == loop) result = d;
    }
  });
  return result;
}

int64_t largest_part(int64_t extent, int64_t most) {
  int64_t part = std::max<int64_t>(1, std::min(extent, most));
  while (extent % part != 0) --part;
  return part;
}

std::optional<int64_t> reduction_chunk(const FuncContents& sums, const FuncContents& block,
                                       const ReductionVariable& loop, const RegisterTile& tile,
                                       int lanes, const SizeEstimate& sizes) {
  const auto extent = as_const_int(simplify(loop.extent));
  const auto number = number_along(sums, block, loop.var);
  if (!extent || *extent <= 0 || !number) return std::nullopt;
  const auto chunk_of = [&](int64_t iterations) -> std::optional<ChunkBytes> {
    const auto operands =
        ChunkReads(sums, block, {{block.args[*number], iterations}}, sizes).operands();
    return operands ? std::optional(bytes_of(*operands, sums, tile, lanes, sizes)) : std::nullopt;
  };
  int64_t iterations = *extent;
  auto bytes = chunk_of(iterations);
  double all = bytes ? bytes->once : 0;  // that the reduction reads
  for (const ReductionVariable& r : sums.updates[0].rvars)
    all *=
        r.var == loop.var ? 1 : static_cast<double>(as_const_int(simplify(r.extent)).value_or(1));
  if (all <= 2 * chunk_bytes) return std::nullopt;
  while (bytes && bytes->once > chunk_bytes && iterations > 1) {
    iterations = largest_part(*extent, iterations - 1);
    bytes = chunk_of(iterations);
  }
  if (!bytes || bytes->once > chunk_bytes) return std::nullopt;
  const double chunked = bytes->once + 2 * static_cast<double>(sizes.bytes(sums));
  return bytes->by_tiles >= worth_a_chunk * chunked ? std::optional(iterations) : std::nullopt;
}

std::optional<TermChunk> chunk_of_terms(const FuncContents& sums, const RegisterTile& tile,
                                        int lanes, const SizeEstimate& sizes) {
  Iterations counts;  // of a chunk
  const auto bytes_of_chunk = [&]() -> std::optional<ChunkBytes> {
    const auto operands = ChunkReads(sums, sums, counts, sizes).operands();
    return operands ? std::optional(bytes_of(*operands, sums, tile, lanes, sizes)) : std::nullopt;
  };
  const auto all = bytes_of_chunk();
  if (!all || all->once <= chunk_bytes) return std::nullopt;
  std::vector<int64_t> extents;
  const std::vector<ReductionVariable> loops = reduction_loops(sums, sums.updates[0]);
  for (const ReductionVariable& r : loops) extents.push_back(*as_const_int(simplify(r.extent)));
  if (std::ranges::any_of(extents, [](int64_t extent) { return extent < 1; })) return std::nullopt;
  double passes = 1;  // over all sums
  for (size_t i = loops.size(); i-- > 0; passes *= static_cast<double>(extents[i])) {
    int64_t& count = counts[loops[i].var] = extents[i];
    double once = bytes_of_chunk()->once;
    while (once > near_bytes && count > 1) {
      const double fitting = static_cast<double>(count) * near_bytes / once;
      count = std::clamp<int64_t>(static_cast<int64_t>(fitting), 1, count - 1);
      once = bytes_of_chunk()->once;
    }
    if (once > near_bytes) continue;
    const int64_t parts = (extents[i] + count - 1) / count;
    const int64_t iterations = (extents[i] + parts - 1) / parts;
    const int64_t terms = std::accumulate(extents.begin(), extents.begin() + static_cast<long>(i),
                                          iterations, std::multiplies<>());
    passes *= static_cast<double>(parts);
    const double chunked = all->once + 2 * passes * static_cast<double>(sizes.bytes(sums));
    if (terms < least_terms || all->by_tiles < worth_a_chunk * chunked) return std::nullopt;
    return TermChunk{i, parts > 1 ? iterations : 0};
  }
  return std::nullopt;
}

}  // namespace retrograde::autoschedule
