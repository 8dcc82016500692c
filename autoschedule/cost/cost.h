// cost.h -- how long a plan takes on a machine and how much memory it needs, without lowering it.
//
//   CostModel model(accesses, sizes, machine);
//   const Cost cost = model.price(plan);       cost.seconds, cost.stages[i].bound_by()
//
// Stages whose loops are nested make a group: a stage at root, the stages that share its loops, and the Funcs that are
// computed inside of these. A group is priced alone, and its price is kept for what it depends on: the plans of its
// Funcs, which Funcs are inlined into them, and the layout of what they read. What an earlier group leaves in the caches
// is subtracted afterwards. The model remembers the last plan: the next one that differs in a Func finds the groups near
// this Func anew, and prices one or two of them.
#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "autoschedule/access/sizes.h"
#include "autoschedule/machine/device.h"
#include "autoschedule/machine/machine.h"
#include "autoschedule/plan/plan.h"

namespace retrograde::planning {

struct StageCost {
  StageId stage;
  double seconds = 0;  // its share of the call's time
  double compute_seconds = 0, launch_seconds = 0;
  double code = 0;  // instructions of its code
  // Bytes that each level supplies, and the time that they take. Those of L1 are part of the compute time.
  std::array<double, Machine::level_count> bytes = {}, memory_seconds = {};
  std::string bound_by() const;  // "compute", "L2", "L3", "memory", "launch"
  double all_memory_seconds() const;
};

struct Totals {
  double seconds = 0;
  double peak_bytes = 0;  // alive at once, of what the program itself allocates
  double code = 0;        // instructions: how long it takes to compile
};
struct Cost : Totals {
  std::vector<StageCost> stages;  // of those that have loops, by StageId
};

class CostModel {
 public:
  // All are referred to. Kernels take the time that they take on the device.
  CostModel(const AccessGraph& accesses, const SizeModel& sizes, const Machine& machine,
            const Device* device = nullptr);
  ~CostModel();
  CostModel(const CostModel&) = delete;
  CostModel& operator=(const CostModel&) = delete;

  // Requires: the plan keeps its invariants, and its program is that of the accesses. An undecided Func counts as
  // inlined, and as computed at root if it is an output.
  Cost price(const Plan& plan);
  // The same without the stages, in less time.
  Totals totals(const Plan& plan);
  // How many groups were priced so far: the others were known.
  size_t groups_priced() const;

 private:
  class Prices;
  std::unique_ptr<Prices> prices_;
};

// A table with a line for each stage.
std::string to_text(const Cost& cost, const Plan& plan);

}  // namespace retrograde::planning
