// timing.h -- elapsed time, medians, and when to save a run.
#pragma once

#include <algorithm>
#include <chrono>
#include <vector>

namespace apps {

inline double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// Says when to save a run: every 20 seconds.
class SaveTimer {
 public:
  // Whether that time has passed since the beginning, or since this was last true.
  bool is_due() {
    if (seconds_since(saved_) < every_seconds_) return false;
    saved_ = std::chrono::steady_clock::now();
    return true;
  }

 private:
  static constexpr double every_seconds_ = 20;
  std::chrono::steady_clock::time_point saved_ = std::chrono::steady_clock::now();
};

// The median; the upper one for an even count, 0 for no values.
inline double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<long>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace apps
