#include "transform/step_sums.h"

#include <optional>
#include <unordered_map>

#include "autoschedule/machine/reference.h"
#include "graph/definitions/own_reads.h"
#include "ir/equal.h"
#include "ir/visit.h"

namespace retrograde::transform {

namespace {

// The bytes of all steps and of one step; the same limits as in lower/loops/fold_steps.cpp.
constexpr int64_t large_bytes = planning::many_step_bytes;
constexpr int64_t most_step_bytes = planning::largest_second_cache_bytes;

// The dimension along which the last update of a Func steps: it reads other elements of it than it stores.
std::optional<size_t> step_dimension(const FuncContents& f) {
  if (f.updates.empty() || f.args.size() < 2) return std::nullopt;
  const Definition& update = f.updates.back();
  for (const Expr& read : graph::own_reads(f, update)) {
    for (size_t d = 0; d < f.args.size() && !update.rvars.empty(); ++d) {
      const Expr& place = update.args[d];
      if (uses_variable(place, update.rvars.back().var) && !equal(place, read.as<Call>()->args[d]))
        return d;
    }
  }
  return std::nullopt;
}

class StepSumFinder {
 public:
  explicit StepSumFinder(const SizeEstimate& sizes) : sizes_(sizes) {}

  void visit(const FuncContents& f) {
    if (const auto d = step_dimension(f)) {
      if (is_large(f, *d)) add_steps(f, *d);
    } else if (f.made && f.updates.size() == 1 && f.updates[0].rvars.size() == 1) {
      if (reads_steps(f.updates[0], f.updates[0].rvars[0].var)) found.sums.insert(&f);
    }
    if (!f.made || steps_.count(&f)) return;
    for (size_t d = 1; d < f.args.size(); ++d) {
      if (!reads_steps(f.stage(0), f.args[d])) continue;
      add_steps(f, d);
    }
  }

  StepSums found;

 private:
  const SizeEstimate& sizes_;
  std::unordered_map<const Symbol*, size_t> steps_;  // Funcs with a dimension of steps

  void add_steps(const FuncContents& f, size_t d) {
    steps_[&f] = d;
    if (f.made) found.steps.insert(&f);
  }

  bool is_large(const FuncContents& f, size_t d) const {
    const int64_t bytes = sizes_.bytes(f), steps = sizes_.extent(f, d).value_or(1);
    return bytes >= large_bytes && bytes / std::max<int64_t>(steps, 1) <= most_step_bytes;
  }

  bool reads_steps(const Definition& stage, const std::string& variable) const {
    bool reads = false;
    graph::walk_definition(stage, [&](const Expr& e) {
      const auto* call = e.as<Call>();
      const auto at = call && call->call_type == CallType::Func ? steps_.find(call->symbol.raw())
                                                                : steps_.end();
      reads = reads || (at != steps_.end() && uses_variable(call->args[at->second], variable));
    });
    return reads;
  }
};

}  // namespace

StepSums step_sums(const std::vector<FuncPtr>& outputs, const SizeEstimate& sizes) {
  StepSumFinder finder(sizes);
  for (const FuncPtr& f : topological_order(outputs)) finder.visit(*f);
  return std::move(finder.found);
}

}  // namespace retrograde::transform
