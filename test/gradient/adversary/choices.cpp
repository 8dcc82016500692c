#include "gradient/adversary/choices.h"

#include <algorithm>

namespace retrograde::gradient {

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
      for (size_t width : {64, 32, 16, 8, 4, 3, 2, 1}) smaller |= remove(width);
      for (size_t width : {16, 8, 4, 1}) smaller |= clear(width);
      smaller |= lower();
    }
    return list_;
  }

 private:
  bool try_list(const List& candidate) {
    if (candidate == list_ || trials_-- <= 0 || !fails_(candidate)) return false;
    list_ = candidate;
    return true;
  }
  bool remove(size_t width) {
    bool any = false;
    for (size_t i = list_.size(); i >= width && trials_ > 0;) {
      List candidate = list_;
      const auto first = candidate.begin() + static_cast<std::ptrdiff_t>(i - width);
      candidate.erase(first, first + static_cast<std::ptrdiff_t>(width));
      any |= try_list(candidate);
      i = std::min(i - 1, list_.size());
    }
    return any;
  }
  bool clear(size_t width) {
    bool any = false;
    for (size_t i = 0; i + width <= list_.size() && trials_ > 0; i += width) {
      List candidate = list_;
      std::fill_n(candidate.begin() + static_cast<std::ptrdiff_t>(i), width, 0u);
      any |= try_list(candidate);
    }
    return any;
  }
  bool lower() {
    bool any = false;
    for (size_t i = 0; i < list_.size(); ++i) {
      for (uint32_t by : {list_[i] / 2, list_[i] / 4, 1u}) {
        if (i >= list_.size() || by == 0 || by > list_[i]) continue;
        List candidate = list_;
        candidate[i] -= by;
        any |= try_list(candidate);
      }
    }
    return any;
  }

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

}  // namespace retrograde::gradient
