// What a loop over time needs of its steps, what its steps give, and how many states are kept.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "autodiff/updates/tape_layout.h"
#include "autodiff/updates/update_context.h"
#include "graph/function.h"

namespace retrograde::autodiff {

struct CheckpointPlan {
  // What iterations contribute at one place of another Func or image.
  struct Given {
    LeafAdjoint leaf;
    bool over_time = false;    // one value for each iteration of each step, not a sum over steps
    bool compensated = false;  // a long sum: what rounding lost is summed beside it
    int width() const { return compensated ? 2 : 1; }
  };

  Expr steps;
  std::optional<int> constant_steps;  // none: known at run time only
  int states = 0;
  ReductionVariable time;
  std::vector<ReductionVariable> inner;  // the loops of one step
  Expr inner_count;
  std::vector<Type> types;                // in which values of f and their adjoints are held
  int sum_value = -1;                     // the value that sums use: the first of a floating type
  std::string at_hand;                    // a variable: the slot of the adjoints at hand
  std::vector<LeafAdjoint> passed_on;     // contributions to f itself
  std::vector<Given> given;               // to others
  std::vector<Expr> needed;               // reads of f that partials and places need, inner first
  std::vector<std::vector<Expr>> places;  // the distinct places of those
  std::vector<size_t> place_of;           // of each needed read
  std::optional<int64_t> bytes_of_state;  // over all pure dimensions; none: not constant

  // Whether a step backward needs values of f.
  bool needs_values() const { return !needed.empty(); }
};

// The adjoints at hand will be read from `machine`, whose types and traits are set here. Throws
// when the budget is too small, or a place forgotten.
CheckpointPlan plan_checkpoints(const UpdateContext& context, const TapeLayout& layout,
                                const FuncPtr& adjoint, const FuncPtr& machine);

}  // namespace retrograde::autodiff
