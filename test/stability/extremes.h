// Generates the inputs of the stability suite: every pair, or many random sets, of ordinary and extreme numbers.
#pragma once

#include <array>
#include <string>
#include <vector>

namespace retrograde::stability {

// Returns the most extreme kind among the numbers of a case; later kinds win.
enum class Extreme { Ordinary, Large, Zeros, Tiny, Denormals, Huge, Infinities, NaNs };
constexpr int extreme_count = 8;
const char* to_string(Extreme extreme);
Extreme extreme_of(const std::vector<float>& numbers);

// Cases of n numbers each. n = 1 and 2: every combination; larger n: random ones, the same each time.
std::vector<std::vector<float>> cases(int n);

}  // namespace retrograde::stability
