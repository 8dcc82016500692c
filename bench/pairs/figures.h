// figures.h -- computations and formatting that both reports share.
#pragma once

#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "pair.h"

namespace bench {

// Like printf; at most 511 characters.
template <typename... Args>
std::string formatted(const char* format, Args... args) {
  char line[512];
  std::snprintf(line, sizeof line, format, args...);
  return line;
}

inline double run_ratio(const PairResult& r) { return r.retrograde.median / r.halide.median; }

// 1 if there are none.
template <typename T, typename F>
double geometric_mean(const std::vector<T>& all, F value) {
  double sum = 0;
  for (const T& each : all) sum += std::log(value(each));
  return all.empty() ? 1 : std::exp(sum / static_cast<double>(all.size()));
}

// The results of those that ran on both sides.
template <typename T>
std::vector<T> completed(const std::vector<T>& results) {
  std::vector<T> out;
  for (const T& r : results) {
    if (r.failure.empty()) out.push_back(r);
  }
  return out;
}

}  // namespace bench
