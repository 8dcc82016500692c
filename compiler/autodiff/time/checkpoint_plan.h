// checkpoint_plan.h -- analyses a loop over time: the values that its steps need, their contributions, and the number
// of states to keep.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "autodiff/updates/tape_layout.h"
#include "autodiff/updates/update_context.h"
#include "graph/function.h"

namespace retrograde::autodiff {

struct CheckpointPlan {
  // The contribution of iterations to one element of another Func or image.
  struct StepContribution {
    LeafAdjoint leaf;
    bool over_time =
        false;  // one value for each iteration of each step, instead of a sum over steps
    bool compensated = false;  // a long sum, which also sums its rounding errors
    int width() const { return compensated ? 2 : 1; }
  };

  Expr steps;
  std::optional<int> constant_steps;  // nullopt: known at run time only
  int states = 0;
  ReductionVariable time;
  std::vector<ReductionVariable> inner;  // the loops of one step
  Expr inner_count;
  std::vector<Type> types;  // types that hold values of f and their adjoints
  int sum_value = -1;       // the value of the Tuple that sums use: the first floating-point one
  std::string at_hand;      // a variable: the slot of the current adjoints
  std::vector<LeafAdjoint> passed_on;           // contributions to f itself
  std::vector<StepContribution> contributions;  // contributions to others
  std::vector<Expr> needed;  // reads of f that partials and indices need, inner reads first
  std::vector<std::vector<Expr>> places;  // the distinct places of `needed`
  std::vector<size_t> place_of;           // for each of `needed`: its number in `places`
  std::optional<int64_t> bytes_of_state;  // over all pure dimensions; nullopt: not constant

  // Whether a backward step needs values of f.
  bool needs_values() const { return !needed.empty(); }
};

// Plans the loop. The current adjoints will be read from `machine`, whose types and traits are set here. Throws if the
// budget is too small, or if an index needs a value that was lost.
CheckpointPlan plan_checkpoints(const UpdateContext& context, const TapeLayout& layout,
                                const FuncPtr& adjoint, const FuncPtr& machine);

}  // namespace retrograde::autodiff
