#include "autoschedule/stage_loops.h"

#include <algorithm>

#include "graph/definitions/own_reads.h"
#include "graph/definitions/race_checks.h"
#include "graph/definitions/reduction_leaves.h"
#include "ir/build.h"
#include "simplify/simplify.h"

namespace retrograde::autoschedule {

namespace {

class LoopFinder {
 public:
  LoopFinder(const FuncContents& f, int stage, const SizeEstimate& sizes)
      : f_(f),
        definition_(f.stage(stage)),
        sizes_(sizes),
        leaves_(graph::leaves_of(definition_, definition_.schedule, "find the loops of a stage")) {
    for (const Expr& arg : definition_.args) places_.push_back(substitute(arg, leaves_.values));
  }

  std::vector<StageLoop> find() const {
    std::vector<StageLoop> loops;
    for (const Dim& dim : definition_.schedule.dims)
      loops.push_back(dim.is_reduction ? of_reduction(dim.var) : of_dimension(dim.var));
    return loops;
  }

 private:
  StageLoop of_dimension(const std::string& name) const {
    const auto arg = std::ranges::find(f_.args, name);
    const auto dimension = static_cast<size_t>(arg - f_.args.begin());
    const auto extent = arg == f_.args.end() ? std::nullopt : sizes_.extent(f_, dimension);
    return {Var(name), extent, reads_own_place(dimension), first_dimension(name)};
  }

  // Adjoints may read the place of another value, where a condition says that it is no other.
  bool reads_own_place(size_t dimension) const {
    return std::ranges::all_of(own_reads(f_, definition_), [&](const Expr& read) {
      const auto* place =
          dimension < f_.args.size() ? read.as<Call>()->args[dimension].as<Variable>() : nullptr;
      return place && place->name == f_.args[dimension];
    });
  }

  StageLoop of_reduction(const std::string& name) const {
    const auto leaf = std::ranges::find(leaves_.all, name, &graph::Leaf::loop);
    const bool is_independent =
        graph::can_prove_race_free(f_, definition_, variable_of(name), {}, true);
    return {RVar(name), as_const_int(simplify(leaf->extent)), is_independent,
            first_dimension(leaf->name)};
  }

  // Partial results keep the names of loops, not of variables.
  std::string variable_of(std::string loop) const {
    const auto& splits = definition_.schedule.splits;
    for (auto split = splits.rbegin(); split != splits.rend(); ++split) {
      if (split->kind == graph::Split::Kind::Rename && split->outer == loop) loop = split->old_var;
    }
    return loop;
  }

  size_t first_dimension(const std::string& variable) const {
    size_t result = f_.args.size();
    for (size_t d = 0; d < f_.args.size(); ++d) {
      if (uses_variable(places_[d], variable)) result = std::min(result, place_in_memory(d));
    }
    return result;
  }

  size_t place_in_memory(size_t dimension) const {
    const auto& order = f_.schedule.storage_dims;
    const auto found = std::ranges::find(order, f_.args[dimension]);
    return found == order.end() ? dimension : static_cast<size_t>(found - order.begin());
  }

  const FuncContents& f_;
  const Definition& definition_;
  const SizeEstimate& sizes_;
  const graph::Leaves leaves_;
  std::vector<Expr> places_;  // over the leaves
};

}  // namespace

std::vector<StageLoop> loops_of_stage(const FuncContents& f, int stage, const SizeEstimate& sizes) {
  return LoopFinder(f, stage, sizes).find();
}

}  // namespace retrograde::autoschedule
