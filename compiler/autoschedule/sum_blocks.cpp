#include "autoschedule/sum_blocks.h"

#include <algorithm>
#include <optional>
#include <string>

#include "autoschedule/hosted_funcs.h"
#include "autoschedule/new_loop.h"
#include "autoschedule/slices.h"
#include "autoschedule/start_in_tiles.h"
#include "frontend/language/func.h"
#include "frontend/schedule/loop_level.h"
#include "frontend/schedule/stage.h"
#include "graph/definitions/own_reads.h"
#include "graph/directives/wrappers.h"
#include "ir/build.h"

namespace retrograde::autoschedule {

namespace {

// A loop of a sum, over blocks of one of its dimensions.
struct BlockLoop {
  std::string var;
  size_t own = 0, of_reader = 0;  // the dimension, and that of the reader which moves with it
  int64_t size = 1;               // elements of a block
};

// All of its stages run over elements, each for itself.
bool is_sum_in_tiles(const FuncContents& f) {
  const bool is_partial = f.made && (f.made->lanes > 0 || f.made->has_parts || f.made->blocks > 0);
  if (is_partial || f.is_extern() || f.is_pure() || !has_tiles(f)) return false;
  return std::ranges::all_of(f.updates, [&](const Definition& update) {
    bool stays = !read_elsewhere(f, update).defined();
    for (size_t d = 0; d < f.args.size(); ++d) stays &= is_pure_position(f, update, d);
    return stays;
  });
}

// Slices of something else are computed in the loops of its reduction: it runs in strips of its own.
bool has_slices(const FuncContents& f, const HostedFuncs& hosted) {
  const std::vector<Dim>& loops = f.updates[0].schedule.dims;
  return std::ranges::any_of(
      loops, [&](const Dim& loop) { return loop.is_reduction && hosted.are_in(f, loop.var); });
}

// The loops of the sum whose iterations make blocks small enough, and are enough tasks.
std::optional<std::vector<BlockLoop>> block_loops(const FuncContents& f, const Reader& reader,
                                                  const HostedFuncs& hosted,
                                                  const SizeEstimate& sizes) {
  const FuncContents& by = *reader.func;
  int64_t block_bytes = sizes.bytes(f), tasks = 1;
  if (block_bytes < sizes.machine().near_cache_bytes()) return std::nullopt;
  std::vector<BlockLoop> result;
  for (const TileLoop& loop : tile_loops(f, f.updates[0])) {
    const bool is_part = loop.loop.var != loop.dimension;
    if (is_part) return std::nullopt;
    BlockLoop block{loop.loop.var, 0, 0, 1};
    block.own = static_cast<size_t>(std::ranges::find(f.args, loop.dimension) - f.args.begin());
    if (loop.split) block.size = as_const_int(loop.split->factor).value_or(0);
    const auto moves = [&](const std::string& var) {
      return sliced_by(f, reader, var) == block.own;
    };
    const auto arg = std::ranges::find_if(by.args, moves);
    const auto extent = sizes.extent(f, block.own);
    if (arg == by.args.begin() || arg == by.args.end() || !extent || block.size < 1)
      return std::nullopt;
    block.of_reader = static_cast<size_t>(arg - by.args.begin());
    const int64_t blocks = (*extent + block.size - 1) / block.size;
    tasks *= blocks;
    block_bytes /= std::max<int64_t>(1, blocks);
    result.push_back(block);
    if (block_bytes <= sizes.machine().task_bytes() && tasks >= sizes.machine().enough_tasks())
      return result;
    if (hosted.are_in(f, block.var)) return std::nullopt;
  }
  return std::nullopt;
}

void move(const FuncPtr& sum, const FuncPtr& reader, const std::vector<BlockLoop>& blocks) {
  run_serially(sum);
  run_serially(reader);
  Stage stage(reader, 0);
  std::vector<VarOrRVar> order, outside;
  for (const BlockLoop& block : blocks)
    outside.insert(outside.begin(), Var(reader->args[block.of_reader]));
  const std::vector<Dim> loops = reader->pure->schedule.dims;
  for (const Dim& loop : loops) {
    const auto block = std::ranges::find_if(
        blocks, [&](const BlockLoop& each) { return reader->args[each.of_reader] == loop.var; });
    if (block == blocks.end()) {
      order.emplace_back(Var(loop.var));
    } else if (block->size > 1) {
      const Var all(loop.var), part(inner_loop(*reader, 0, loop.var));
      stage.split(all, all, part, static_cast<int>(block->size), TailStrategy::GuardWithIf);
      order.emplace_back(part);
    }
  }
  order.insert(order.end(), outside.begin(), outside.end());
  stage.reorder(order);
  for (const VarOrRVar& loop : outside) stage.parallel(loop);
  Func(sum).compute_at(Func(reader), Var(outside.front().name()));
}

}  // namespace

void compute_sums_in_blocks(const std::vector<FuncPtr>& outputs, const Readers& readers,
                            const std::vector<FuncPtr>& given,
                            const std::unordered_set<const Symbol*>& but,
                            const SizeEstimate& sizes) {
  const auto may_share = [&](const FuncPtr& f) {
    return std::ranges::count(given, f) > 0 && is_at_root(*f) && !but.contains(f.get());
  };
  HostedFuncs hosted(outputs);
  for (const FuncPtr& sum : given) {
    if (!may_share(sum) || !readers.is_inside(sum) || readers.is_output(sum) ||
        !is_sum_in_tiles(*sum) || has_slices(*sum, hosted))
      continue;
    const auto reader = readers.only_reader(sum);
    if (!reader || !may_share(reader->func) || !has_plain_rows(*reader->func) ||
        hosted.are_in(*reader->func))
      continue;
    const auto blocks = block_loops(*sum, *reader, hosted, sizes);
    if (!blocks) continue;
    move(sum, reader->func, *blocks);
    hosted.add(*reader->func, sum->schedule.compute_level.var);
  }
}

}  // namespace retrograde::autoschedule
