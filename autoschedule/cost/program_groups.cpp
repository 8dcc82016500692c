// The groups of a plan: stages whose loops are nested.
#include <algorithm>
#include <map>
#include <numeric>

#include "autoschedule/cost/group.h"

namespace retrograde::planning {

namespace {

bool insert_once(std::vector<FuncId>& list, FuncId func) {
  const auto place = std::ranges::lower_bound(list, func);
  const bool is_new = place == list.end() || *place != func;
  if (is_new) list.insert(place, func);
  return is_new;
}

// Whether the Func is inlined and has one value, which composed reads can replace.
bool is_value(const Plan& plan, const FuncNode& node, FuncId func) {
  return is_inlined(plan, func) && plan.of(func).opacity == Opacity::None &&
         node.stages.size() == 1;
}

// The Func in whose loops it runs; itself if there is none.
FuncId host_of(const Plan& plan, FuncId func) {
  const Level& compute = plan.of(func).placement.compute;
  if (compute.kind == Level::Kind::At) return compute.loop.stage.func;
  for (const Nest& nest : plan.of(func).nests)
    if (nest.shared_with && nest.shared_with->stage.func != func)
      return nest.shared_with->stage.func;
  return func;
}

// The Funcs of other groups that a stage reads, and those that are inlined into it.
void add_reads(const StageNode& stage, const AccessGraph& graph, const std::vector<bool>& inlined,
               PlannedGroup& group) {
  for (const Access& access : stage.reads) {
    const FuncId read = access.of;
    if (read < 0 || read == stage.id.func) continue;
    if (!inlined[static_cast<size_t>(read)]) {
      if (!std::ranges::binary_search(group.funcs, read)) insert_once(group.reads, read);
    } else if (insert_once(group.inlined.back(), read)) {
      add_reads(graph.func(read).stages[0], graph, inlined, group);
    }
  }
}

}  // namespace

// Groups run in the order of their last Funcs: all that a group reads is before it.
std::vector<PlannedGroup> groups_of(const Plan& plan, const AccessGraph& graph) {
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
    inlined[f] = is_value(plan, graph.func(func), func);
    if (inlined[f]) continue;
    const FuncId a = root(func), b = root(host_of(plan, func));
    group[static_cast<size_t>(std::min(a, b))] = std::max(a, b);
  }
  std::map<FuncId, PlannedGroup> found;
  for (size_t f = 0; f < count; ++f) {
    const auto func = static_cast<FuncId>(f);
    if (!inlined[f]) found[root(func)].funcs.push_back(func);
  }
  std::vector<PlannedGroup> result;
  for (auto& [last, own] : found) {
    for (const FuncId func : own.funcs) {
      for (const StageNode& stage : graph.func(func).stages) {
        own.inlined.emplace_back();
        add_reads(stage, graph, inlined, own);
      }
    }
    result.push_back(std::move(own));
  }
  return result;
}

}  // namespace retrograde::planning
