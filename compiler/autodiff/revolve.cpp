#include "autodiff/revolve.h"

#include <algorithm>

namespace retrograde::ir {

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

// The least number of times that every step may run with so many states.
int64_t repetitions_for(int64_t steps, int64_t states) {
  if (states == 1) return steps - 1;
  int64_t r = 0;
  while (revolve_steps_within(states, r) < steps) ++r;
  return r;
}

class Schedule {
 public:
  std::vector<RevolveAction> actions;

  // Reverses the steps in [begin, end). State `begin` is current and, unless one step is left, is
  // to be kept in `slot`, the first of `states` free ones.
  void reverse(int begin, int end, int slot, int states) {
    if (end - begin > 1) add(RevolveAction::Kind::Store, begin, slot);
    while (end - begin > 1) {
      int middle = begin + first_part(end - begin, states);
      for (int step = begin; step < middle; ++step) add(RevolveAction::Kind::Advance, step);
      reverse(middle, end, slot + 1, states - 1);
      end = middle;
      add(RevolveAction::Kind::Restore, begin, slot);
    }
    add(RevolveAction::Kind::Reverse, begin);
  }

 private:
  void add(RevolveAction::Kind kind, int step, int slot = -1) {
    actions.push_back({kind, step, slot});
  }

  // Steps before the next kept state: all but one, when none may be kept.
  static int first_part(int64_t steps, int64_t states) {
    if (states == 1) return static_cast<int>(steps - 1);
    int64_t r = repetitions_for(steps, states);
    return static_cast<int>(std::min(revolve_steps_within(states, r - 1),
                                     steps - revolve_steps_within(states - 1, r - 1)));
  }
};

}  // namespace

int64_t revolve_advances(int64_t steps, int64_t states) {
  if (states == 1) return steps * (steps - 1) / 2;
  int64_t r = repetitions_for(steps, states);
  return r * steps - revolve_steps_within(states + 1, r - 1);
}

std::vector<RevolveAction> revolve_schedule(int steps, int states) {
  Schedule schedule;
  schedule.reverse(0, steps, 0, std::min(states, steps));
  return std::move(schedule.actions);
}

}  // namespace retrograde::ir
