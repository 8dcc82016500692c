// The bytes that a program has allocated at once.
#include <algorithm>

#include "autoschedule/cost/group.h"

namespace retrograde::planning {

double allocated_bytes(FuncId func, const Plan& plan, const SizeModel& sizes) {
  const FuncNode& node = sizes.graph().func(func);
  if (node.is_output || plan.of(func).placement.compute.kind == Level::Kind::At) return 0;
  double bytes = 0;
  for (const Type& type : node.func->types) bytes += type.bytes();
  for (const double extent : stored_extents(func, plan.of(func), sizes)) bytes *= extent;
  return bytes;
}

double peak_bytes(const std::vector<PlannedGroup>& groups, const std::vector<double>& root,
                  const std::vector<double>& own) {
  std::vector<size_t> last(groups.size());  // the group that reads a Func last
  for (size_t g = 0; g < groups.size(); ++g) {
    for (const FuncId func : groups[g].funcs) last[static_cast<size_t>(func)] = g;
    for (const FuncId read : groups[g].reads) last[static_cast<size_t>(read)] = g;
  }
  std::vector<double> freed(groups.size());  // after each group
  double alive = 0, peak = 0;
  for (size_t g = 0; g < groups.size(); ++g) {
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
