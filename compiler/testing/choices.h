// Random decisions that can be replayed and shrunk: a program is a function of the list of choices
// that its generator took.
//
// Drawn from a seed the list has no end; replayed from a list it continues with zeros. A generator
// gives the choice 0 to the simplest alternative, so a shorter list, or one with smaller numbers,
// makes a simpler program, and every list makes a legal one: the reducer needs to know nothing of
// programs.
// Idea: D. MacIver and A. Donaldson, Test-Case Reduction via Test-Case Generation, ECOOP 2020.
#pragma once

#include <cstdint>
#include <functional>
#include <random>
#include <vector>

namespace retrograde::fuzz {

class Choices {
 public:
  explicit Choices(uint64_t seed) : engine_(seed * 0x9e3779b97f4a7c15u + 1), is_replay_(false) {}
  explicit Choices(std::vector<uint32_t> replay) : replay_(std::move(replay)), is_replay_(true) {}

  int below(int n);
  int between(int low, int high) { return low + below(high - low + 1); }
  // What one of the functions gives; the first one is the simplest.
  template <typename Result>
  Result one_of(std::initializer_list<std::function<Result()>> alternatives) {
    return alternatives.begin()[below(static_cast<int>(alternatives.size()))]();
  }
  // False is the simpler answer.
  bool chance(int percent) { return below(100) >= 100 - percent; }
  // A small number of either sign; 0 is the simplest, then 1, -1, 2 ...
  int around_zero(int most);
  template <typename T>
  T pick(const std::vector<T>& from) {
    return from[static_cast<size_t>(below(static_cast<int>(from.size())))];
  }
  const std::vector<uint32_t>& taken() const { return taken_; }

 private:
  std::mt19937_64 engine_;
  std::vector<uint32_t> replay_, taken_;
  bool is_replay_;
};

// The smallest list found whose program still fails, after `max_trials` trials at most. `fails` is
// true of the list given.
std::vector<uint32_t> shrink_choices(std::vector<uint32_t> choices,
                                     const std::function<bool(const std::vector<uint32_t>&)>& fails,
                                     int max_trials = 1500);

}  // namespace retrograde::fuzz
