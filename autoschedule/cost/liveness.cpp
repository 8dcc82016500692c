// The bytes that a program has allocated at once.
#include <algorithm>

#include "autoschedule/cost/group.h"

namespace retrograde::planning {

namespace {

double allocated_bytes(FuncId func, const FuncPlan& plan, const SizeModel& sizes) {
  const FuncContents& f = *sizes.graph().func(func).func;
  double bytes = 0;
  for (const Type& type : f.types) bytes += type.bytes();
  for (const double extent : stored_extents(func, plan, sizes)) bytes *= extent;
  return bytes;
}

}  // namespace

double peak_bytes(const Plan& plan, const SizeModel& sizes, const std::vector<PlannedGroup>& groups,
                  const std::vector<double>& own) {
  std::vector<size_t> last(plan.funcs.size());  // the group that reads it last
  for (size_t g = 0; g < groups.size(); ++g) {
    for (const FuncId func : groups[g].funcs) last[static_cast<size_t>(func)] = g;
    for (const FuncId read : groups[g].reads) last[static_cast<size_t>(read)] = g;
  }
  std::vector<double> freed(groups.size());  // after each group
  double alive = 0, peak = 0;
  for (size_t g = 0; g < groups.size(); ++g) {
    for (const FuncId func : groups[g].funcs) {
      const FuncPlan& of = plan.of(func);
      if (of.placement.compute.kind == Level::Kind::At || sizes.graph().func(func).is_output)
        continue;
      const double bytes = allocated_bytes(func, of, sizes);
      alive += bytes;
      freed[last[static_cast<size_t>(func)]] += bytes;
    }
    peak = std::max(peak, alive + own[g]);
    alive -= freed[g];
  }
  return peak;
}

}  // namespace retrograde::planning
