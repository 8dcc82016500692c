#include "autoschedule/rewrites/copy_operands.h"

#include <algorithm>

#include "autoschedule/access/cover.h"
#include "autoschedule/access/lane_form.h"
#include "autoschedule/access/long_sums.h"
#include "autoschedule/machine/reference.h"
#include "graph/directives/give_directive.h"
#include "graph/directives/wrappers.h"

namespace retrograde::planning {

namespace {

constexpr double least_uses = 4;      // of an element of a copy
constexpr double least_share = 0.02;  // of the reads of all stages

double product_of(const std::vector<int64_t>& extents) {
  double product = 1;
  for (const int64_t extent : extents) product *= static_cast<double>(extent);
  return product;
}

class OperandCopier {
 public:
  explicit OperandCopier(const AccessGraph& accesses)
      : accesses_(accesses), sizes_(accesses_, {unknown_extent}) {
    for (const FuncNode& node : accesses_.funcs()) {
      for (const StageNode& stage : node.stages) reads_ += reads_of(stage);
    }
  }

  void run(ir::FunctionRef<bool(const graph::FuncContents&)> may_change) const {
    for (const FuncNode& node : accesses_.funcs()) {
      if (!may_change(*node.func)) continue;
      for (const StageNode& stage : node.stages) {
        if (is_contraction(stage) && reads_of(stage) >= least_share * reads_) copy(node, stage);
      }
    }
  }

 private:
  const AccessGraph& accesses_;
  const SizeModel sizes_;
  double reads_ = 0;  // of all stages

  double points(const StageNode& stage) const { return product_of(whole_cover(stage.id, sizes_)); }
  double reads_of(const StageNode& stage) const {
    return points(stage) * static_cast<double>(stage.reads.size());
  }
  static bool is_contraction(const StageNode& stage) {
    return stage.id.stage > 0 && !reduction_of(stage).empty() && adds_in_place(stage);
  }

  void copy(const FuncNode& node, const StageNode& stage) const {
    for (const Access& read : stage.reads) {
      if (!is_worth_copying(node, stage, read)) continue;
      if (read.of < 0) {
        const auto& image = accesses_.images()[static_cast<size_t>(read.image)];
        graph::copied_input(node.func, image, image->name + "_in_" + node.func->name);
      } else {
        const graph::FuncPtr& source = accesses_.func(read.of).func;
        graph::wrapper_of(source, {node.func}, source->name + "_in_" + node.func->name, false);
      }
    }
  }

  bool is_worth_copying(const FuncNode& node, const StageNode& stage, const Access& read) const {
    if (read.of == stage.id.func || count_of(node, read) != 1) return false;
    if (read.of >= 0) {
      const graph::FuncContents& source = *accesses_.func(read.of).func;
      if (source.is_extern() || source.schedule.compute_level.kind == graph::LoopLevel::Kind::At)
        return false;
    }
    if (std::ranges::any_of(read.index, [](const IndexForm& form) { return form.has_data(); }))
      return false;
    const Cover cover = whole_cover(stage.id, sizes_);
    if (product_of(cover) < least_uses * product_of(extents(read, cover, sizes_))) return false;
    const std::vector<int> lanes = iterators_of_lanes(stage, cover);
    return std::ranges::any_of(lanes, [&](int i) {
      const LaneForm::Kind kind = lane_form(read, i, schedule_lanes, sizes_, {line_elements}).kind;
      if (kind == LaneForm::Kind::Uniform) return false;
      return kind != LaneForm::Kind::Contiguous ||
             (is_shared(stage, read, cover) &&
              (rows(stage, read, cover) >= first_cache_ways || computes(read)));
    });
  }
  // Pure iterators along which vectors of elements may run: those of rows, if these are not too short.
  static std::vector<int> iterators_of_lanes(const StageNode& stage, const Cover& cover) {
    std::vector<int> result;
    for (size_t i = 0; i < cover.size(); ++i) {
      if (stage.iterators[i].kind == Iterator::Kind::Reduction || 2 * cover[i] < schedule_lanes)
        continue;
      result.push_back(static_cast<int>(i));
      if (stage.iterators[i].dimension == 0) break;
    }
    return result;
  }
  // Whether elements of the result that differ in a pure iterator read the same.
  static bool is_shared(const StageNode& stage, const Access& read, const Cover& cover) {
    for (size_t i = 0; i < stage.iterators.size(); ++i) {
      const bool is_pure = stage.iterators[i].kind == Iterator::Kind::Pure;
      if (is_pure && cover[i] > 1 && (read.moved_by() & set_of(static_cast<int>(i))) == 0)
        return true;
    }
    return false;
  }
  // That the terms of one element read.
  static double rows(const StageNode& stage, const Access& read, const Cover& cover) {
    IteratorSet moving = 0;
    for (size_t d = 1; d < read.index.size(); ++d) moving |= read.index[d].moved_by();
    double result = 1;
    for (const int i : reduction_of(stage)) {
      if ((moving & set_of(i)) != 0) result *= static_cast<double>(cover[static_cast<size_t>(i)]);
    }
    return result;
  }
  // Whether the copy would save operations of a Func that several others read.
  bool computes(const Access& read) const {
    if (read.of < 0) return false;
    const FuncNode& source = accesses_.func(read.of);
    return source.stages.size() == 1 && accesses_.consumers(read.of).size() > 1 &&
           std::ranges::any_of(source.stages[0].operations,
                               [](const auto& operation) { return operation.count > 0; });
  }

  // The copy of several reads would hold what lies between them.
  static int64_t count_of(const FuncNode& node, const Access& read) {
    int64_t count = 0;
    for (const StageNode& stage : node.stages) {
      count += std::ranges::count_if(stage.reads, [&](const Access& other) {
        return other.of == read.of && other.image == read.image;
      });
    }
    return count;
  }
};

}  // namespace

void copy_operands(const std::vector<graph::FuncPtr>& outputs,
                   ir::FunctionRef<bool(const graph::FuncContents&)> may_change,
                   AccessGraph& accesses) {
  accesses = AccessGraph(outputs, std::move(accesses));
  OperandCopier(accesses).run(may_change);
}

}  // namespace retrograde::planning
