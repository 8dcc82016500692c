// checkpoint_actions.h -- the table of actions that a checkpointed loop executes.
//
// The rows are those of revolve.h. If the number n of steps is constant, they are an image. If it is known at run time
// only, a Func computes them in the pipeline by the same rules:
//   f_actions(p)   [ frames, depth 0 to s | rows ]   a Tuple of three integers
//   frame          begin, end, r: the steps at this depth that must still be reversed, and how often each of them may
//                  run at most
//   row            action, step, depth: each row follows from the previous one and its frame
// Splitting a frame of n steps with s states and r repetitions leaves frames with r - 1 (the first part) and r. So r is
// searched for only once, among C(s + r, s).
#pragma once

#include <array>
#include <functional>
#include <string>

#include "graph/function.h"

namespace retrograde::autodiff {

// The action of one pass over the inner loops.
enum class Action : int { Idle = -1, Store, Restore, Advance, Record, Adjoint };
inline constexpr size_t action_kinds = 5;

struct ActionTable {
  Expr rows;  // number of rows
  // The columns of a row: an Action, a step, a slot for states.
  std::function<Expr(int column, const Expr& row)> entry;
  std::array<Expr, action_kinds> counts;  // number of rows of each kind
  FuncPtr computed_by;                    // computes the table at run time; null: constant table
  const Expr& count(Action action) const { return counts[static_cast<size_t>(action)]; }
};

// The table for loops whose backward steps do not need the state before them: nothing is kept or recomputed.
ActionTable reversals_alone(const Expr& steps);
// A constant table.
ActionTable action_table(int steps, int states);
// A table computed at run time by a Func of this name. Calls with more than most_steps_at_run_time steps fail.
ActionTable action_table(const Expr& steps, int states, const std::string& name);

// The most rows of a table, and the most steps that certainly fit.
inline constexpr int64_t most_rows = int64_t{1} << 24;
int most_steps_at_run_time(int states);
// The most states of a table computed at run time, which has a column for each.
inline constexpr int most_states_at_run_time = 1 << 16;

}  // namespace retrograde::autodiff
