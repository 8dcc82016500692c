// checkpoints.cpp -- see checkpoints.h.
#include "checkpoints.h"

#include <algorithm>

namespace fluid {

namespace {

constexpr int64_t plenty = int64_t{1} << 40;

// C(slots + repeats, slots): the longest run that needs to advance no frame more often than `repeats` times; at most
// `plenty`.
int64_t longest(int64_t slots, int64_t repeats) {
  if (slots < 0 || repeats < 0) return 0;
  int64_t product = 1;
  for (int64_t k = 1; k <= std::min(slots, repeats); ++k) {
    product = product * (std::max(slots, repeats) + k) / k;  // exact: a binomial coefficient
    if (product >= plenty) return plenty;
  }
  return product;
}

int64_t repeats_needed(int64_t frames, int64_t slots) {
  int64_t repeats = 0;
  while (longest(slots, repeats) < frames) ++repeats;
  return repeats;
}

// Where to split a run of `frames` >= 2. Both parts then need one repeat or one slot less, and neither is so short that
// the other gets more expensive.
int cut(int frames, int slots) {
  const int64_t repeats = repeats_needed(frames, slots);
  const int64_t at_most = longest(slots, repeats - 1);
  const int64_t at_least = std::max<int64_t>(1, longest(slots, repeats - 2));
  const int64_t wanted = frames - longest(slots - 1, repeats - 1);
  return static_cast<int>(std::clamp(wanted, at_least, std::min<int64_t>(at_most, frames - 1)));
}

class Backward {
 public:
  Backward(int slots, const std::function<void(const Action&)>& act) : slots_(slots), act_(act) {}

  // Handles frames first, ..., end - 1. State `first` is the current one and is in `slot`; later slots are free.
  void run(int first, int end, int slot) {
    while (end - first > 1) {
      const int free = slots_ - slot;  // including the slot that holds state `first`
      const int middle = free == 1 ? end - 1 : first + cut(end - first, free);
      for (int frame = first; frame < middle; ++frame) act_({Action::Kind::Advance, frame});
      if (free == 1) {
        act_({Action::Kind::Reverse, middle});
      } else {
        act_({Action::Kind::Save, middle, slot + 1});
        run(middle, end, slot + 1);
      }
      act_({Action::Kind::Load, first, slot});
      end = middle;
    }
    act_({Action::Kind::Reverse, first});
  }

 private:
  int slots_;
  const std::function<void(const Action&)>& act_;
};

}  // namespace

void run_backward(int frames, int slots, const std::function<void(const Action&)>& act) {
  act({Action::Kind::Load, 0, 0});
  Backward(std::min(slots, frames), act).run(0, frames, 0);
}

int64_t advances(int frames, int slots) {
  const int64_t used = std::min(slots, frames);
  const int64_t repeats = repeats_needed(frames, used);
  return repeats * frames - longest(used + 1, repeats - 1);
}

}  // namespace fluid
