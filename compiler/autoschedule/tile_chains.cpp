#include "autoschedule/tile_chains.h"

#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <unordered_map>

#include "autoschedule/new_loop.h"
#include "autoschedule/slices.h"
#include "autoschedule/stored_reads.h"
#include "frontend/language/func.h"
#include "frontend/schedule/loop_level.h"
#include "frontend/schedule/stage.h"
#include "graph/definitions/own_reads.h"
#include "ir/build.h"

namespace retrograde::autoschedule {

namespace {

// Of a tiled stage, from that of the rows of tiles outwards.
struct TileLoops {
  std::vector<size_t> dimensions;
  int64_t rows = 1;  // of a tile
};

// Two dimensions were cut, and the parts are the innermost loops.
std::optional<TileLoops> tile_loops(const FuncContents& f) {
  const StageLoops& loops = f.pure->schedule;
  if (!f.is_pure() || f.is_extern() || loops.splits.size() != 2) return std::nullopt;
  const Split &columns = loops.splits[0], &rows = loops.splits[1];
  const auto height = as_const_int(rows.factor);
  if (columns.outer != f.args[0] || rows.outer == f.args[0] || !height ||
      loops.dims[0].var != columns.inner || loops.dims[1].var != rows.inner)
    return std::nullopt;
  TileLoops result{{}, *height};
  bool is_outside = false;
  for (const Dim& loop : loops.dims) {
    is_outside |= loop.var == rows.outer;
    if (!is_outside) continue;
    const auto arg = std::find(f.args.begin(), f.args.end(), loop.var);
    if (arg == f.args.end() || arg == f.args.begin()) return std::nullopt;
    result.dimensions.push_back(static_cast<size_t>(arg - f.args.begin()));
  }
  return result.dimensions.empty() ? std::nullopt : std::optional(result);
}

class Chain {
 public:
  Chain(FuncPtr last, TileLoops loops, const StoredReads& reads, const SizeEstimate& sizes)
      : last_(std::move(last)), loops_(std::move(loops)), reads_(reads), sizes_(sizes) {
    moved_by_[last_.get()] = loops_.dimensions;
  }

  // Readers first. Scans have blocks of their own (column_blocks.h), and sums tiles in registers.
  void consider(const FuncPtr& f, bool may_move) {
    const auto moved_by = dimensions_of(f);
    if (!moved_by) return;
    if (is_at_root(*f)) {
      const int64_t all = sizes_.bytes(*f), block = bytes_of_block(*f, *moved_by);
      const planning::Machine& machine = sizes_.machine();
      if (!may_move || all < machine.near_cache_bytes() || bytes_ + block > machine.task_bytes())
        return;
      bytes_ += block;
      members_.push_back(f);
    }
    moved_by_[f.get()] = *moved_by;
  }

  void give() const {
    if (members_.empty() || tasks() < sizes_.machine().enough_tasks()) return;
    const auto loop = [&](size_t d) { return Var(last_->args[d]); };
    run_serially(last_);
    for (const size_t d : loops_.dimensions) Stage(last_, 0).parallel(loop(d));
    for (const FuncPtr& f : members_) {
      run_serially(f);
      Func(f).compute_at(Func(last_), loop(loops_.dimensions[0]));
    }
  }

 private:
  // Of f, for each loop the dimension that it alone moves; nullopt: an iteration reads more.
  std::optional<std::vector<size_t>> dimensions_of(const FuncPtr& f) const {
    const std::vector<StoredRead>& all = reads_.of(f);
    std::optional<std::vector<size_t>> result;
    for (const StoredRead& read : all) {
      const auto outer = moved_by_.find(read.reader.get());
      if (outer == moved_by_.end()) return std::nullopt;
      Reader reader{read.reader, read.stage, {}};
      for (const Expr& call : read.calls) reader.reads.push_back(call.as<Call>());
      std::vector<size_t> own;
      for (const size_t d : outer->second) {
        const auto dimension = sliced_by(*f, reader, read.reader->args[d]);
        if (!dimension) return std::nullopt;
        own.push_back(*dimension);
      }
      if (result && *result != own) return std::nullopt;
      result = own;
    }
    return reads_.is_hidden(f) ? std::nullopt : result;
  }

  int64_t bytes_of_block(const FuncContents& f, const std::vector<size_t>& moved_by) const {
    int64_t bytes = sizes_.bytes(f);
    for (const size_t d : moved_by) bytes /= std::max<int64_t>(1, sizes_.extent(f, d).value_or(1));
    return bytes * loops_.rows;
  }
  int64_t tasks() const {
    int64_t tasks = 1;
    for (const size_t d : loops_.dimensions) tasks *= sizes_.extent(*last_, d).value_or(1);
    return tasks / loops_.rows;
  }

  const FuncPtr last_;
  const TileLoops loops_;
  const StoredReads& reads_;
  const SizeEstimate& sizes_;
  std::vector<FuncPtr> members_;
  std::unordered_map<const Symbol*, std::vector<size_t>> moved_by_;  // by loop
  int64_t bytes_ = 0;
};

}  // namespace

void compute_in_tiles(const std::vector<FuncPtr>& outputs, const Readers& readers,
                      const std::vector<FuncPtr>& given,
                      const std::unordered_set<const Symbol*>& but, const SizeEstimate& sizes) {
  const auto is_free = [&](const FuncPtr& f) {
    return readers.is_inside(f) && !but.contains(f.get());
  };
  std::optional<StoredReads> reads;
  for (auto last = given.rbegin(); last != given.rend(); ++last) {
    const auto loops = tile_loops(**last);
    if (!loops || !is_at_root(**last) || !is_free(*last)) continue;
    if (!reads) reads.emplace(outputs);
    Chain chain(*last, *loops, *reads, sizes);
    for (auto f = last + 1; f != given.rend(); ++f)
      chain.consider(*f, is_free(*f) && (*f)->is_pure() && !readers.is_output(*f) && !(*f)->made);
    chain.give();
  }
}

}  // namespace retrograde::autoschedule
