// What a checkpointed loop does, row by row: actions on the current state.
#pragma once

#include <array>
#include <functional>

#include "ir/expr.h"

namespace retrograde::ir {

// What one pass over the inner loops does.
enum class Action : int { Store, Restore, Advance, Record, Adjoint };
inline constexpr size_t action_kinds = 5;

struct ActionTable {
  Expr rows;  // how many
  // Of a row: an Action, a step, a slot for states.
  std::function<Expr(int column, const Expr& row)> entry;
  std::array<Expr, action_kinds> counts;  // rows of each kind
  const Expr& count(Action action) const { return counts[static_cast<size_t>(action)]; }
};

// The rows of revolve.h, in memory. needs_values: whether a step backward needs the state before
// it; else nothing is kept, and nothing run again.
ActionTable action_table(int steps, int states, bool needs_values);

}  // namespace retrograde::ir
