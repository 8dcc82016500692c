#include "autoschedule/column_blocks.h"

#include <algorithm>
#include <optional>
#include <string>

#include "autoschedule/machine/reference.h"
#include "autoschedule/new_loop.h"
#include "autoschedule/slices.h"
#include "frontend/language/func.h"
#include "frontend/schedule/loop_level.h"
#include "frontend/schedule/stage.h"
#include "graph/definitions/own_reads.h"
#include "ir/build.h"

namespace retrograde::autoschedule {

namespace {

constexpr int64_t columns = 4 * planning::line_elements;           // of a block, in each row
constexpr int64_t block_bytes = planning::second_cache_bytes / 2;  // at most

// A sum keeps its tile in registers, and has no use for a block of its own.
bool is_scan(const FuncContents& f) {
  return std::ranges::any_of(
      f.updates, [&](const Definition& update) { return read_elsewhere(f, update).defined(); });
}

struct Blocks {
  std::string column;                // the reader's variable that is cut into blocks
  int64_t tiles = 1;                 // of its inner loop, in a block
  std::vector<std::string> outside;  // its outer loops that have slices of their own
};

class BlockFinder {
 public:
  BlockFinder(const FuncPtr& f, const Reader& reader, const SizeEstimate& sizes)
      : f_(*f), reader_(reader), g_(*reader.func), sizes_(sizes) {}

  std::optional<Blocks> find() const {
    Blocks result;
    int64_t bytes = sizes_.bytes(f_), tasks = 1;
    if (bytes < sizes_.machine().last_cache_bytes() / 4) return std::nullopt;
    for (const std::string& var : g_.args) {
      const auto d = sliced_by(f_, reader_, var);
      const auto extent = d ? sizes_.extent(f_, *d) : std::nullopt;
      if (!extent) continue;
      if (*d == 0) {
        const auto inner = inner_size(var);
        if (!inner || columns % *inner != 0) return std::nullopt;
        result.column = var;
        result.tiles = columns / *inner;
        tasks *= *extent / columns;
        bytes = bytes / *extent * columns;
      } else if (is_whole_loop(var)) {
        result.outside.push_back(var);
        tasks *= *extent;
        bytes /= *extent;
      }
    }
    const bool pays =
        !result.column.empty() && tasks >= sizes_.machine().enough_tasks() && bytes <= block_bytes;
    return pays ? std::optional(result) : std::nullopt;
  }

 private:
  // The loop over the variable was split once, by the constant.
  std::optional<int64_t> inner_size(const std::string& var) const {
    std::optional<int64_t> result;
    for (const Split& split : reader_.definition().schedule.splits) {
      if (split.old_var != var && split.inner != var && split.outer != var) continue;
      if (result || split.old_var != var || split.outer != var) return std::nullopt;
      result = as_const_int(split.factor);
    }
    return result;
  }
  bool is_whole_loop(const std::string& var) const {
    const auto& dims = reader_.definition().schedule.dims;
    return !is_split(reader_.definition(), var) &&
           std::ranges::any_of(dims, [&](const Dim& dim) { return dim.var == var; });
  }

  const FuncContents& f_;
  const Reader& reader_;
  const FuncContents& g_;
  const SizeEstimate& sizes_;
};

void give_blocks(const FuncPtr& f, const FuncPtr& reader, const Blocks& blocks) {
  run_serially(f);
  run_serially(reader);
  Stage stage(reader, 0);
  const Var block(blocks.column), tiles(new_loop(*reader, 0, "tile"));
  std::vector<VarOrRVar> order, outside{block};
  for (const Dim& loop : reader->pure->schedule.dims) {
    if (loop.var == blocks.column)
      order.push_back(tiles);
    else if (std::ranges::find(blocks.outside, loop.var) != blocks.outside.end())
      outside.push_back(Var(loop.var));
    else
      order.push_back(Var(loop.var));
  }
  stage.split(block, block, tiles, static_cast<int>(blocks.tiles), TailStrategy::GuardWithIf);
  order.insert(order.end(), outside.begin(), outside.end());
  stage.reorder(order);
  for (const VarOrRVar& loop : outside) stage.parallel(loop);
  Func(f).compute_at(Func(reader), block);
}

}  // namespace

void compute_in_column_blocks(const Readers& readers, const std::vector<FuncPtr>& stored,
                              const std::unordered_set<const Symbol*>& but,
                              const SizeEstimate& sizes) {
  std::unordered_set<const Symbol*> cut;
  for (const FuncPtr& f : stored) {
    const bool may_move = is_scan(*f) && !f->made && is_at_root(*f) && readers.is_inside(f) &&
                          !readers.is_output(f) && !but.contains(f.get());
    const auto reader = may_move ? readers.only_reader(f) : std::nullopt;
    if (!reader || !reader->func->is_pure() || !is_at_root(*reader->func) ||
        but.contains(reader->func.get()) || cut.contains(reader->func.get()))
      continue;
    const auto blocks = BlockFinder(f, *reader, sizes).find();
    if (!blocks) continue;
    cut.insert(reader->func.get());
    give_blocks(f, reader->func, *blocks);
  }
}

}  // namespace retrograde::autoschedule
