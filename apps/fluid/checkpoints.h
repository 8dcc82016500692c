// checkpoints.h -- checkpointing: decides which states of a simulation are kept while it is run backward.
//
// A run of n frames goes from state 0 to state n. Running frame i backward needs state i. With space for s states the
// run is split: advance to state m, keep it, run the later frames backward with the other s - 1 slots, then the earlier
// frames with all s. Every frame is advanced at most r times, where C(s + r, s) >= n. m is chosen to minimize the total
// number of advances: r n - C(s + r, r - 1) (A. Griewank and A. Walther, Algorithm 799: revolve, ACM Transactions on
// Mathematical Software 26(1), 2000, section 2). With as many slots as frames nothing is recomputed.
#pragma once

#include <cstdint>
#include <functional>

namespace fluid {

// An action on the current state; there is only one.
struct Action {
  enum class Kind : uint8_t {
    Load,     // the state in `slot`, which is state `frame`, becomes the current one
    Save,     // the current state, which is state `frame`, is stored in `slot`
    Advance,  // from state `frame` to the next one
    Reverse   // runs frame `frame` backward from the current state, which is state `frame`
  };
  Kind kind;
  int frame;
  int slot = -1;
};

// Calls `act` with the actions that run frames n - 1, ..., 0 backward. State 0 is in slot 0 already, and stays there.
// Requires frames >= 1 and slots >= 1; slots beyond the number of frames are not used.
void run_backward(int frames, int slots, const std::function<void(const Action&)>& act);

// The number of frames that this advances.
int64_t advances(int frames, int slots);

}  // namespace fluid
