#include "autoschedule/rewrites/split_sums.h"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>

#include "autoschedule/access/long_sums.h"
#include "autoschedule/machine/reference.h"
#include "autoschedule/rewrites/split_update.h"
#include "graph/definitions/associative_update.h"

namespace retrograde::planning {

using namespace graph;

namespace {

constexpr int64_t few_elements = schedule_lanes;
constexpr int64_t bytes_of_part = first_cache_bytes / 2;
constexpr double additions_to_element = 16;  // of a privatised copy

// ---- which updates are split, and how ----

class SumSplitter {
 public:
  explicit SumSplitter(const AccessGraph& accesses)
      : accesses_(accesses), sizes_(accesses_, {unknown_extent}) {}

  void run(ir::FunctionRef<bool(const graph::FuncContents&)> may_change) const {
    for (const FuncNode& node : accesses_.funcs()) {
      if (!may_change(*node.func)) continue;
      for (const StageNode& stage : node.stages) {
        if (stage.id.stage == 0 || node.func->stage(stage.id.stage).rvars.empty()) continue;
        SplitUpdate update(node.func, stage.id.stage);
        if (is_sum_to_few(node, stage))
          split_into_lanes(update, stage);
        else if (is_small_scatter(node, stage))
          split_into_parts(update, stage);
        else if (is_left_long(node, stage))
          split_into_blocks(update, stage);
        else
          continue;
        update.finish();
      }
    }
  }

 private:
  const AccessGraph& accesses_;
  const SizeModel sizes_;

  static bool takes_any_order(const FuncNode& node, const StageNode& stage) {
    const AssociativityProof proof =
        prove_associative(*node.func, node.func->stage(stage.id.stage));
    return proof.op && proof.op->commutative && !proof.op->breaks_ties;
  }
  int64_t extent(const StageNode& stage, int iterator) const {
    return std::max<int64_t>(sizes_.of(stage.id, iterator).estimate, 1);
  }
  static const std::string& name(const StageNode& stage, int iterator) {
    return stage.iterators[static_cast<size_t>(iterator)].name;
  }

  // ---- few elements ----

  bool is_sum_to_few(const FuncNode& node, const StageNode& stage) const {
    if (terms_of(stage.id, sizes_) < many_terms || !adds_in_place(stage)) return false;
    int64_t elements = 1;
    for (size_t i = 0; i < stage.iterators.size(); ++i) {
      const auto iterator = static_cast<int>(i);
      if (stage.iterators[i].kind == Iterator::Kind::Reduction) continue;
      if (!sizes_.of(stage.id, iterator).is_known()) return false;
      elements *= extent(stage, iterator);
    }
    return elements <= few_elements && takes_any_order(node, stage);
  }

  // Lanes are terms of the first loop that is long enough, and each iteration of the longest of the others is a task; a
  // single loop is in blocks. Groups of rows are added up before all are.
  void split_into_lanes(SplitUpdate& update, const StageNode& stage) const {
    const std::vector<int> loops = reduction_of(stage);
    size_t lanes = 0;
    while (lanes + 1 < loops.size() && extent(stage, loops[lanes]) < schedule_lanes) ++lanes;
    size_t rows = lanes;
    for (size_t i = 0; i < loops.size(); ++i) {
      const int64_t n = extent(stage, loops[i]);
      if (i != lanes && n >= reference_tasks && (rows == lanes || n > extent(stage, loops[rows])))
        rows = i;
    }
    const std::string all = name(stage, loops[lanes]);
    std::string row = name(stage, loops[rows]), inside = all;
    if (rows == lanes) inside = update.split(all, "terms", schedule_lanes * lane_terms);
    const std::string lane = update.split(inside, "lane", schedule_lanes);
    update.factor({{lane, "lanes"}, {row, "parts"}});
    const std::string group = update.split(row, "group", privatised_copies);
    update.factor({{lane, "lanes"}, {group, "parts"}});
  }

  // ---- data-dependent indices ----

  // The longest loop but the innermost, if it has rows for each part.
  std::optional<int> rows_in_parts(const StageNode& stage) const {
    std::optional<int> result;
    const std::vector<int> loops = reduction_of(stage);
    for (size_t i = 1; i < loops.size(); ++i) {
      const int64_t n = extent(stage, loops[i]);
      if (n >= privatised_copies && (!result || n > extent(stage, *result))) result = loops[i];
    }
    return result;
  }
  bool is_small_scatter(const FuncNode& node, const StageNode& stage) const {
    const FuncContents& f = *node.func;
    const bool is_scatter =
        std::ranges::any_of(stage.write.index, [](const auto& form) { return form.has_data(); });
    if (f.made || f.types.size() != 1 || !is_scatter || !rows_in_parts(stage)) return false;
    double elements = 1;
    for (size_t d = 0; d < f.args.size(); ++d)
      elements *= static_cast<double>(sizes_.of(stage.id.func, d).estimate);
    return elements * f.types[0].bytes() <= bytes_of_part &&
           terms_of(stage.id, sizes_) >= privatised_copies * elements * additions_to_element &&
           takes_any_order(node, stage);
  }
  void split_into_parts(SplitUpdate& update, const StageNode& stage) const {
    const std::string rows = name(stage, *rows_in_parts(stage));
    update.factor({{update.split(rows, "part", privatised_copies), "parts"}});
  }

  // ---- long chains ----

  bool is_left_long(const FuncNode& node, const StageNode& stage) const {
    return is_long_sum(stage.id, sizes_) && !is_short_in_lanes(stage.id, sizes_) &&
           takes_any_order(node, stage);
  }
  // A block has about as many terms as there are blocks: the error is that of both chains.
  void split_into_blocks(SplitUpdate& update, const StageNode& stage) const {
    const double all = terms_of(stage.id, sizes_);
    int64_t most = least_block_terms;
    while (most < most_block_terms && 4 * static_cast<double>(most * most) <= all) most *= 2;
    std::vector<std::pair<std::string, std::string>> blocks;
    int64_t inside = 1;  // terms of a block so far
    for (const int i : reduction_of(stage)) {
      const std::string loop = name(stage, i);
      if (blocks.empty() && inside * extent(stage, i) <= most) {
        inside *= extent(stage, i);
        continue;
      }
      const int64_t n = blocks.empty() ? most / inside : 1;
      if (n > 1) update.split(loop, "term", n);
      blocks.emplace_back(loop, "blocks");
    }
    update.factor(blocks);
  }
};

}  // namespace

void split_sums(const std::vector<graph::FuncPtr>& outputs,
                ir::FunctionRef<bool(const graph::FuncContents&)> may_change,
                AccessGraph& accesses) {
  accesses = AccessGraph(outputs, std::move(accesses));
  SumSplitter(accesses).run(may_change);
}

}  // namespace retrograde::planning
