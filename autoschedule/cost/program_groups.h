// program_groups.h -- the groups of a plan, in the order in which they run.
#pragma once

#include <vector>

#include "autoschedule/cost/group.h"

namespace retrograde::planning {

struct PlannedGroup {
  GroupMembers members;
  std::vector<FuncId> reads;  // Funcs of other groups, also through inlined ones; each once
};

// Remembers which Funcs a Func reads.
class GroupFinder {
 public:
  explicit GroupFinder(const AccessGraph& graph);
  std::vector<PlannedGroup> groups_of(const Plan& plan) const;

 private:
  const AccessGraph& graph_;
  std::vector<std::vector<std::vector<FuncId>>> reads_;  // by Func and stage

  FuncId host_of(const Plan& plan, FuncId func) const;
  void add_reads(PlannedGroup& group, StageId stage, const std::vector<bool>& inlined) const;
};

// The bytes alive at once; `own`: what each group allocates for the Funcs that are computed in its loops.
double peak_bytes(const Plan& plan, const SizeModel& sizes, const std::vector<PlannedGroup>& groups,
                  const std::vector<double>& own);

}  // namespace retrograde::planning
