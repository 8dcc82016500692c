#include "autodiff/time/revolve.h"

#include <algorithm>

namespace retrograde::autodiff {

int64_t revolve_steps_within(int64_t states, int64_t repetitions) {
  constexpr int64_t enough = int64_t{1} << 40;
  if (states < 0 || repetitions < 0) return 0;
  int64_t result = 1, few = std::min(states, repetitions), many = std::max(states, repetitions);
  for (int64_t i = 1; i <= few; ++i) {
    result = result * (many + i) / i;
    if (result > enough) return enough;
  }
  return result;
}

namespace {

// The least number of times that every step must be allowed to run with `states` states.
int64_t repetitions_for(int64_t steps, int64_t states) {
  if (states == 1) return steps - 1;
  int64_t r = 0;
  while (revolve_steps_within(states, r) < steps) ++r;
  return r;
}

// A stretch of steps, whose first state is kept, is split in two. The later part is reversed first; then the stretch
// continues with the part before the cut. As many stretches are open as states are kept, possibly millions, so they
// form a list instead of recursive calls.
class Schedule {
 public:
  Schedule(int steps, int states) : states_(states) {
    open(0, steps);
    while (!stretches_.empty()) {
      if (stretches_.back().end - stretches_.back().begin > 1)
        cut();
      else
        reverse();
    }
  }

  std::vector<RevolveAction> actions;

 private:
  struct Stretch {
    int begin, end;
  };

  // Opens a stretch; the current state is `begin`. The state is stored unless the stretch has a single step.
  void open(int begin, int end) {
    stretches_.push_back({begin, end});
    if (end - begin > 1) add(RevolveAction::Kind::Store, begin, slot());
  }
  void cut() {
    Stretch& now = stretches_.back();
    const int end = now.end, middle = now.begin + first_part(end - now.begin, states_ - slot());
    for (int step = now.begin; step < middle; ++step) add(RevolveAction::Kind::Advance, step);
    now.end = middle;
    open(middle, end);
  }
  void reverse() {
    add(RevolveAction::Kind::Reverse, stretches_.back().begin);
    stretches_.pop_back();
    if (!stretches_.empty()) add(RevolveAction::Kind::Restore, stretches_.back().begin, slot());
  }

  // The slot in which the innermost stretch keeps its first state.
  int slot() const { return static_cast<int>(stretches_.size()) - 1; }
  void add(RevolveAction::Kind kind, int step, int slot = -1) {
    actions.push_back({kind, step, slot});
  }

  // The number of steps before the next kept state; all except one if no further state may be kept.
  static int first_part(int64_t steps, int64_t states) {
    if (states == 1) return static_cast<int>(steps - 1);
    int64_t r = repetitions_for(steps, states);
    return static_cast<int>(std::min(revolve_steps_within(states, r - 1),
                                     steps - revolve_steps_within(states - 1, r - 1)));
  }

  int states_;
  std::vector<Stretch> stretches_;  // the innermost last
};

}  // namespace

int64_t revolve_advances(int64_t steps, int64_t states) {
  if (states == 1) return steps * (steps - 1) / 2;
  int64_t r = repetitions_for(steps, states);
  return r * steps - revolve_steps_within(states + 1, r - 1);
}

std::vector<RevolveAction> revolve_schedule(int steps, int states) {
  return std::move(Schedule(steps, std::min(states, steps)).actions);
}

}  // namespace retrograde::autodiff
