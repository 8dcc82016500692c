// The bytes that a program has allocated at once.
#include <algorithm>

#include "autoschedule/cost/group.h"
#include "graph/computing_order.h"

namespace retrograde::planning {

double allocated_bytes(FuncId func, const Plan& plan, const SizeModel& sizes) {
  const FuncNode& node = sizes.graph().func(func);
  if (node.is_output || plan.of(func).placement.compute.kind == Level::Kind::At) return 0;
  double bytes = 0;
  for (const Type& type : node.func->types) bytes += type.bytes();
  for (const double extent : stored_extents(func, plan.of(func), sizes)) bytes *= extent;
  return bytes;
}

std::vector<size_t> places_in_order(const AccessGraph& graph) {
  std::vector<graph::ComputedFunc> funcs;
  for (const FuncNode& node : graph.funcs())
    funcs.push_back({{}, {}, node.func->args.size(), node.is_output});
  for (size_t f = 0; f < funcs.size(); ++f) {
    for (const StageId reader : graph.consumers(static_cast<FuncId>(f))) {
      std::vector<size_t>& reads = funcs[static_cast<size_t>(reader.func)].callees;
      const bool is_new = reads.empty() || reads.back() != f;
      if (is_new && static_cast<size_t>(reader.func) != f) reads.push_back(f);
    }
  }
  const std::vector<size_t> order = graph::computing_order(funcs);
  std::vector<size_t> places(order.size());
  for (size_t i = 0; i < order.size(); ++i) places[order[i]] = i;
  return places;
}

double peak_bytes(const std::vector<PlannedGroup>& groups, const std::vector<size_t>& places,
                  const std::vector<double>& root, const std::vector<double>& own) {
  constexpr size_t none = SIZE_MAX;
  // All that a group reads is before the last of its Funcs.
  std::vector<size_t> turns(groups.size(), none);  // by place: the group that runs there
  for (size_t g = 0; g < groups.size(); ++g) {
    if (groups[g].funcs.empty()) continue;
    const auto place = [&](FuncId func) { return places[static_cast<size_t>(func)]; };
    turns[place(std::ranges::max(groups[g].funcs, {}, place))] = g;
  }
  std::erase(turns, none);
  std::vector<size_t> last(groups.size());  // the group that reads a Func last
  for (const size_t g : turns) {
    for (const FuncId func : groups[g].funcs) last[static_cast<size_t>(func)] = g;
    for (const FuncId read : groups[g].reads) last[static_cast<size_t>(read)] = g;
  }
  std::vector<double> freed(groups.size());  // after each group
  double alive = 0, peak = 0;
  for (const size_t g : turns) {
    for (const FuncId func : groups[g].funcs) {
      alive += root[static_cast<size_t>(func)];
      freed[last[static_cast<size_t>(func)]] += root[static_cast<size_t>(func)];
    }
    peak = std::max(peak, alive + own[g]);
    alive -= freed[g];
  }
  return peak;
}

}  // namespace retrograde::planning
