// checkpoints.h -- which states of a simulation are kept while it is run backward.
//
// A run of n frames goes from state 0 to state n. To run frame i backward, state i is needed. With
// room for s states the run is cut in two: advance to state m, keep it, run the frames after it
// backward with the s - 1 slots that are left, then those before it with all s. Every frame is
// advanced at most r times where C(s + r, s) >= n, and m is chosen so that the sum is the least there
// is: r n - C(s + r, r - 1) (A. Griewank and A. Walther, Algorithm 799: revolve, ACM Transactions on
// Mathematical Software 26(1), 2000, section 2). With as many slots as frames nothing is computed
// again.
#pragma once

#include <cstdint>
#include <functional>

namespace fluid {

// What is done with the one current state.
struct Action {
  enum class Kind : uint8_t {
    Load,     // the state in `slot`, which is state `frame`, becomes the current one
    Save,     // the current state, which is state `frame`, is kept in `slot`
    Advance,  // from state `frame` to the next one
    Reverse   // frame `frame` backward, from the current state, which is state `frame`
  };
  Kind kind;
  int frame;
  int slot = -1;
};

// Calls `act` for what runs frames n - 1, ..., 0 backward. State 0 is in slot 0 already, and stays.
// Needs frames >= 1 and slots >= 1; of more slots than frames the rest is not used.
void run_backward(int frames, int slots, const std::function<void(const Action&)>& act);

// The frames that this advances.
int64_t advances(int frames, int slots);

}  // namespace fluid
