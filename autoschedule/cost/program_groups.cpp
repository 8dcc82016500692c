#include "autoschedule/cost/program_groups.h"

#include <algorithm>
#include <map>
#include <numeric>

namespace retrograde::planning {

namespace {

void insert_once(std::vector<FuncId>& list, FuncId func) {
  const auto place = std::ranges::lower_bound(list, func);
  if (place == list.end() || *place != func) list.insert(place, func);
}

}  // namespace

GroupFinder::GroupFinder(const AccessGraph& graph) : graph_(graph) {
  for (const FuncNode& node : graph.funcs()) {
    auto& stages = reads_.emplace_back();
    for (const StageNode& stage : node.stages) {
      auto& reads = stages.emplace_back();
      for (const Access& read : stage.reads)
        if (read.of >= 0 && read.of != stage.id.func) insert_once(reads, read.of);
    }
  }
}

// The Func in whose loops it runs; itself if there is none.
FuncId GroupFinder::host_of(const Plan& plan, FuncId func) const {
  const Level& compute = plan.of(func).placement.compute;
  if (compute.kind == Level::Kind::At) return compute.loop.stage.func;
  for (const Nest& nest : plan.of(func).nests)
    if (nest.shared_with && nest.shared_with->stage.func != func)
      return nest.shared_with->stage.func;
  return func;
}

// Groups run in the order of their last Funcs: all that a group reads is before it.
std::vector<PlannedGroup> GroupFinder::groups_of(const Plan& plan) const {
  const size_t count = plan.funcs.size();
  std::vector<FuncId> group(count);
  std::iota(group.begin(), group.end(), 0);
  const auto root = [&](FuncId func) {
    while (group[static_cast<size_t>(func)] != func) func = group[static_cast<size_t>(func)];
    return func;
  };
  std::vector<bool> inlined(count);
  for (size_t f = 0; f < count; ++f) {
    const auto func = static_cast<FuncId>(f);
    inlined[f] = is_inlined(plan, graph_, func);
    if (inlined[f]) continue;
    const FuncId a = root(func), b = root(host_of(plan, func));
    group[static_cast<size_t>(std::min(a, b))] = std::max(a, b);
  }
  std::map<FuncId, PlannedGroup> found;
  for (size_t f = 0; f < count; ++f) {
    if (inlined[f]) continue;
    PlannedGroup& own = found[root(static_cast<FuncId>(f))];
    own.members.funcs.push_back(static_cast<FuncId>(f));
  }
  std::vector<PlannedGroup> result;
  for (auto& [last, own] : found) {
    for (const FuncId func : own.members.funcs) {
      for (size_t s = 0; s < reads_[static_cast<size_t>(func)].size(); ++s)
        add_reads(own, {func, static_cast<int16_t>(s)}, inlined);
    }
    result.push_back(std::move(own));
  }
  return result;
}

void GroupFinder::add_reads(PlannedGroup& group, StageId stage,
                            const std::vector<bool>& inlined) const {
  std::vector<FuncId>& inside = group.members.inlined.emplace_back();
  std::vector<FuncId> pending{stage.func};
  const auto visit = [&](const std::vector<FuncId>& reads) {
    for (const FuncId read : reads) {
      if (!inlined[static_cast<size_t>(read)]) {
        if (!std::ranges::binary_search(group.members.funcs, read)) insert_once(group.reads, read);
      } else if (!std::ranges::binary_search(inside, read)) {
        insert_once(inside, read);
        pending.push_back(read);
      }
    }
  };
  visit(reads_[static_cast<size_t>(stage.func)][static_cast<size_t>(stage.stage)]);
  for (size_t i = 1; i < pending.size(); ++i) visit(reads_[static_cast<size_t>(pending[i])][0]);
}

}  // namespace retrograde::planning
