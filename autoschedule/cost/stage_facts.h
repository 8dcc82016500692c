// stage_facts.h -- what one point of a stage computes and touches, with the Funcs that are inlined into it.
#pragma once

#include <map>
#include <vector>

#include "autoschedule/access/compose.h"
#include "autoschedule/cost/operation_time.h"
#include "autoschedule/cost/touch.h"

namespace retrograde::planning {

struct OperationRow {
  OperationTime time;
  double element_bytes = 4;
  IteratorSet depends = 0;
  double count = 0;
};

struct StageFacts {
  std::vector<Touch> touches;
  std::vector<OperationRow> operations;
  double taken = 1;  // the points at which the stage's condition holds
};

class FactsOfStages {
 public:
  FactsOfStages(const SizeModel& sizes, const Machine& machine);
  // `inlined`: the Funcs that are inlined into the stage, by number.
  const StageFacts& of(StageId stage, const std::vector<FuncId>& inlined);

 private:
  const AccessGraph& graph_;
  const SizeModel& sizes_;
  const Machine& machine_;
  const Motions motions_;
  ReadComposer composer_;
  std::map<std::pair<StageId, std::vector<FuncId>>, StageFacts> known_;

  StageFacts find(const StageNode& stage, const std::vector<FuncId>& inlined);
  std::vector<Touch> touches(const StageNode& stage, const std::vector<Access>& reads) const;
  std::vector<OperationRow> operations(const StageNode& stage,
                                       const ReadComposer::Composed& composed) const;
};

}  // namespace retrograde::planning
