// timed.h -- run times of functions.
#pragma once

#include <chrono>

namespace retrograde::checks {

// A result and the time that it took.
template <class T>
struct Timed {
  T value;
  double seconds;
};
template <class F>
auto timed(F&& f) -> Timed<decltype(f())> {
  const auto start = std::chrono::steady_clock::now();
  auto value = f();
  return {value, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count()};
}
// Runs f twice and times the second run, since the first one compiles.
template <class F>
auto timed_warm(F&& f) {
  f();
  return timed(f);
}

}  // namespace retrograde::checks
