// adam.h -- Adam (D. Kingma, J. Ba, Adam: A Method for Stochastic Optimization, ICLR 2015, algorithm 1)
// on a flat vector, with a safeguard.
//
//   m <- b1 m + (1 - b1) g,   v <- b2 v + (1 - b2) g^2,
//   x <- x - rate(t) m / (1 - b1^t) / (sqrt(v / (1 - b2^t)) + epsilon)
//
// The safeguard is ours: where the loss or an element of the gradient is not finite, or the loss has exploded
// (AdamOptions::explosion), nothing is learned from it. x goes back to where the last finite gradient was met, the moments are halved, as is the rate
// for all steps to come, and the refusal is counted. So a step that leaves the domain of the model is taken
// back and tried again at half the length.
#pragma once

#include <cmath>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "common/state.h"

namespace apps {

struct AdamGroup {
  size_t size;  // neighbouring elements of the vector
  double rate;
};

struct AdamOptions {
  double beta1 = 0.9, beta2 = 0.999, epsilon = 1e-8;
  // A factor on all rates by the number of the step, from 0; empty: 1.
  std::function<double(long step)> schedule = {};
  bool safeguard = true;
  // A loss over so many times the lowest so far, where that is above 0, counts as not finite.
  double explosion = INFINITY;
};

// From 1 at the first step to `last` at the last, by a constant factor.
std::function<double(long)> exponential_schedule(long steps, double last);

class Adam {
 public:
  explicit Adam(std::vector<AdamGroup> groups, AdamOptions options = {});

  // One step from x, where the loss and its gradient are as given. False when it was refused: then
  // x is where it was before the last step. Float: what is computed is in double.
  bool step(std::span<double> x, double loss, std::span<const double> gradient);
  bool step(std::span<float> x, double loss, std::span<const float> gradient);

  long steps() const { return steps_; }      // taken
  long refused() const { return refused_; }  // by the safeguard
  double rate_factor() const;                // schedule times what refusals left

  void save(State& state, const std::string& name) const;
  void restore(const State& state, const std::string& name);

 private:
  template <typename T>
  bool step_of(std::span<T> x, double loss, std::span<const T> gradient);
  template <typename T>
  void refuse(std::span<T> x);

  std::vector<AdamGroup> groups_;
  AdamOptions options_;
  std::vector<double> first_, second_, before_;  // moments; the last x that had a finite gradient
  long steps_ = 0, refused_ = 0;
  double halvings_ = 1;
  double lowest_ = INFINITY;  // loss so far
};

}  // namespace apps
