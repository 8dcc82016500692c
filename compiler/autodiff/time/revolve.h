// revolve.h -- the optimal checkpointing schedule: which states of a loop to keep while it runs backward.
//
// A loop of n steps goes from state 0 to state n. Running step i backward needs state i; a state that was not kept is
// recomputed from the nearest earlier one. Kept states are freed as soon as the steps after them are done. With room
// for s states the least number of recomputed steps is
//   T(n, s) = r n - B(s + 1, r - 1),   B(s, r) = C(s + r, s),   B(s, r - 1) < n <= B(s, r)
// It is attained by splitting n into m steps and the remainder, and each part recursively (A. Griewank, A. Walther,
// Algorithm 799: revolve, ACM Transactions on Mathematical Software 26(1), 2000, section 2).
#pragma once

#include <cstdint>
#include <vector>

namespace retrograde::autodiff {

struct RevolveAction {
  enum class Kind : uint8_t {
    Store,    // copies the current state, which is state `step`, to `slot`
    Restore,  // makes `slot`, which holds state `step`, the current state
    Advance,  // runs step `step` forward
    Reverse,  // runs step `step` backward from the current state `step`, which is lost
  };
  Kind kind;
  int step;
  int slot = -1;
};

// C(states + repetitions, states), 0 for negative numbers, at most 2^40. This is the number of steps that can be
// reversed with `states` states if each step runs at most `repetitions` times.
int64_t revolve_steps_within(int64_t states, int64_t repetitions);

// The number of recomputed steps, without the run that each reversal includes. steps >= 1, states >= 1.
int64_t revolve_advances(int64_t steps, int64_t states);

// The actions that reverse steps - 1, ..., 0, starting from state 0, with slots 0, ..., states - 1.
std::vector<RevolveAction> revolve_schedule(int steps, int states);

}  // namespace retrograde::autodiff
