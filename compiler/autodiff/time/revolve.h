// Which states of a loop to keep while it is run backward, when there is room for a few only.
//
// A loop of n steps goes from state 0 to state n. Running step i backward needs state i; a state
// that was not kept is computed again from the nearest one before it. With room for s states, kept
// ones freed as soon as the steps after them are done, the least number of steps computed again is
//   T(n, s) = r n - B(s + 1, r - 1),   B(s, r) = C(s + r, s),   B(s, r - 1) < n <= B(s, r)
// reached by cutting n into m steps and a rest, each again of such sizes (A. Griewank, A. Walther,
// Algorithm 799: revolve, ACM Transactions on Mathematical Software 26(1), 2000, section 2).
#pragma once

#include <cstdint>
#include <vector>

namespace retrograde::autodiff {

struct RevolveAction {
  enum class Kind : uint8_t {
    Store,    // the current state, which is state `step`, to `slot`
    Restore,  // `slot`, which holds state `step`, becomes the current state
    Advance,  // from state `step` to the next one
    Reverse,  // step `step` backward; the current state is state `step`, and lost afterwards
  };
  Kind kind;
  int step;
  int slot = -1;
};

// C(states + repetitions, states), 0 for negative numbers, at most 2^40: the number of steps that
// can be reversed with so many states when each runs so often at most.
int64_t revolve_steps_within(int64_t states, int64_t repetitions);

// Steps computed again, beside the one that each reversal runs itself. steps >= 1, states >= 1.
int64_t revolve_advances(int64_t steps, int64_t states);

// The actions that reverse steps - 1, ..., 0, starting from state 0, with slots 0, ..., states - 1.
std::vector<RevolveAction> revolve_schedule(int steps, int states);

}  // namespace retrograde::autodiff
