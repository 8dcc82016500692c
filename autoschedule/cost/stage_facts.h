// stage_facts.h -- what one point of a stage computes and touches, with the Funcs that are inlined into it.
#pragma once

#include <map>
#include <vector>

#include "autoschedule/access/compose.h"
#include "autoschedule/cost/touch.h"
#include "autoschedule/machine/machine.h"

namespace retrograde::planning {

// Nanoseconds of one operation with independent ones around it.
struct OperationTime {
  double vector_ns = 0;  // of a vector as wide as the machine's
  double scalar_ns = 0;
  bool is_integer = false;  // a scalar is computed beside vectors, by other units
};

// `name`: of a kind of node or of an operator, as OperationCount has it.
OperationTime operation_time(const std::string& name, Type type, const Machine& machine);

struct OperationRow {
  OperationTime time;
  double element_bytes = 4;
  IteratorSet depends = 0;
  double count = 0;
  bool behind_branch = false;  // a function in an arm of a select: unrolled copies don't share it
  IteratorSet decided_by = 0;  // a select that copies for each of their points don't need
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
