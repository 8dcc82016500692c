// choices.h -- random decisions that can be replayed and shrunk: a program is a function of the list of choices that
// its generator took.
//
// Drawn from a seed, the list is endless; replayed from a list, it continues with zeros. A generator maps the choice 0
// to the simplest alternative. So a shorter list, or one with smaller numbers, gives a simpler program, and every list
// gives a legal one: the reducer needs no knowledge of programs. Idea: D. MacIver and A. Donaldson, Test-Case Reduction
// via Test-Case Generation, ECOOP 2020.
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
  // Returns the result of one of the functions; the first one is the simplest.
  template <typename Result>
  Result one_of(std::initializer_list<std::function<Result()>> alternatives) {
    return alternatives.begin()[below(static_cast<int>(alternatives.size()))]();
  }
  // False is the simpler result.
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

// Returns the smallest list found whose program still fails, after at most `max_trials` trials. `fails` must hold for
// `choices`.
std::vector<uint32_t> shrink_choices(std::vector<uint32_t> choices,
                                     const std::function<bool(const std::vector<uint32_t>&)>& fails,
                                     int max_trials = 1500);

}  // namespace retrograde::fuzz
