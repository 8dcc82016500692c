// How many programs or samples a test takes: few usually, many in long runs (RETROGRADE_MANY_PROGRAMS).
#pragma once

namespace retrograde {

#ifdef RETROGRADE_MANY_PROGRAMS
constexpr bool takes_many = true;
#else
constexpr bool takes_many = false;
#endif

template <typename T>
constexpr T many_or_few(T many, T few) {
  return takes_many ? many : few;
}

}  // namespace retrograde
