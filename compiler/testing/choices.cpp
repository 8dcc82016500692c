#include "testing/choices.h"

#include <algorithm>

namespace retrograde::fuzz {

int Choices::below(int n) {
  uint64_t drawn = 0;
  if (!is_replay_) {
    drawn = engine_();
  } else if (taken_.size() < replay_.size()) {
    drawn = replay_[taken_.size()];
  }
  taken_.push_back(static_cast<uint32_t>(drawn % static_cast<uint64_t>(n)));
  return static_cast<int>(taken_.back());
}

int Choices::around_zero(int most) {
  const int k = below(2 * most + 1);
  return k % 2 == 1 ? (k + 1) / 2 : -k / 2;
}

namespace {

using List = std::vector<uint32_t>;

class Shrinking {
 public:
  Shrinking(List list, const std::function<bool(const List&)>& fails, int trials)
      : list_(std::move(list)), fails_(fails), trials_(trials) {}

  List run() {
    for (bool smaller = true; smaller && trials_ > 0;) {
      smaller = false;
      for (int width : {256, 64, 32, 16, 8, 4, 3, 2, 1})
        smaller |= try_places(width, [](At first, At last, List& l) { l.erase(first, last); });
      for (int width : {64, 16, 4, 1})
        smaller |= try_places(width, [](At first, At last, List&) { std::fill(first, last, 0u); });
      for (uint32_t share : {2u, 4u, 1u << 31})
        smaller |= try_places(1, [&](At first, At, List&) {
          *first -= std::min(*first, std::max(*first / share, 1u));
        });
      // Decrements a count, and removes the choices of one item.
      for (int width = 2; width < 24 && !smaller; ++width)
        smaller = try_places(width, [](At first, At last, List& l) {
          if (*first > 0) --*first, l.erase(first + 1, last);
        });
    }
    return list_;
  }

 private:
  using At = List::iterator;
  // Applies `edit` to each part of the list of this width, from its end, in steps of half the width.
  template <typename Edit>
  bool try_places(int width, const Edit& edit) {
    bool any = false;
    for (int i = size(); i >= width && trials_ > 0;
         i = std::min(i - std::max(width / 2, 1), size())) {
      List candidate = list_;
      edit(candidate.begin() + i - width, candidate.begin() + i, candidate);
      if (candidate == list_ || trials_-- <= 0 || !fails_(candidate)) continue;
      list_ = candidate;
      any = true;
    }
    return any;
  }
  int size() const { return static_cast<int>(list_.size()); }

  List list_;
  const std::function<bool(const List&)>& fails_;
  int trials_;
};

}  // namespace

std::vector<uint32_t> shrink_choices(std::vector<uint32_t> choices,
                                     const std::function<bool(const List&)>& fails,
                                     int max_trials) {
  return Shrinking(std::move(choices), fails, max_trials).run();
}

}  // namespace retrograde::fuzz
