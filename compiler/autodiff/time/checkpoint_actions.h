// What a checkpointed loop does, row by row: actions on the current state.
//
// The rows are those of revolve.h. Where the number n of steps is a constant they are an image.
// Where it is known at run time only, a Func makes them as the pipeline runs, of the same rules:
//   f_actions(p)   [ frames, depth 0 to s | rows ]   a Tuple of three integers
//   frame          begin, end, r: the steps at this depth that are still to be reversed, and how
//                  often each of them may run at most
//   row            action, step, depth: the next one follows from the row before and its frame
// Cutting a frame of n steps with s states and r leaves frames of r - 1 (the first part) and r, so
// r is looked for once, among C(s + r, s).
#pragma once

#include <array>
#include <functional>
#include <string>

#include "graph/function.h"

namespace retrograde::autodiff {

// What one pass over the inner loops does; Idle: nothing.
enum class Action : int { Idle = -1, Store, Restore, Advance, Record, Adjoint };
inline constexpr size_t action_kinds = 5;

struct ActionTable {
  Expr rows;  // how many
  // Of a row: an Action, a step, a slot for states.
  std::function<Expr(int column, const Expr& row)> entry;
  std::array<Expr, action_kinds> counts;  // rows of each kind
  FuncPtr made_by;                        // at run time; null: nobody
  const Expr& count(Action action) const { return counts[static_cast<size_t>(action)]; }
};

// Where no step backward needs the state before it: nothing is kept, and nothing run again.
ActionTable reversals_alone(const Expr& steps);
// In memory.
ActionTable action_table(int steps, int states);
// Made at run time by a Func of this name. With more steps than most_steps_at_run_time calls fail.
ActionTable action_table(const Expr& steps, int states, const std::string& name);

// Rows that a table may have, and the number of steps that certainly needs no more.
inline constexpr int64_t most_rows = int64_t{1} << 24;
int most_steps_at_run_time(int states);
// States that a table made at run time may use: it has a column for each.
inline constexpr int most_states_at_run_time = 1 << 16;

}  // namespace retrograde::autodiff
