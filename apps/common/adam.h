// adam.h -- the Adam optimizer (D. Kingma, J. Ba, Adam: A Method for Stochastic Optimization, ICLR 2015, algorithm 1)
// on a flat vector, with a safeguard.
//
//   m <- b1 m + (1 - b1) g,   v <- b2 v + (1 - b2) g^2,
//   x <- x - rate(t) m / (1 - b1^t) / (sqrt(v / (1 - b2^t)) + epsilon)
//
// The safeguard is our own addition. A step is refused if the loss or an element of the gradient is not finite, or if
// the loss has exploded (AdamOptions::explosion). Then x returns to the point of the last finite gradient, the moments
// and the rates of all later steps are halved, and the refusal is counted. So a step that leaves the model's domain is
// undone and retried at half the length.
#pragma once

#include <cmath>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "common/state.h"

namespace apps {

struct AdamGroup {
  size_t size;  // a range of the vector's elements
  double rate;
};

struct AdamOptions {
  double beta1 = 0.9, beta2 = 0.999, epsilon = 1e-8;
  // A factor on all rates as a function of the step's number, from 0; empty: 1.
  std::function<double(long step)> schedule = {};
  bool safeguard = true;
  // A loss larger than this multiple of the lowest positive loss so far counts as not finite.
  double explosion = INFINITY;
};

// Falls from 1 at the first step to `last` at the last, by a constant factor.
std::function<double(long)> exponential_schedule(long steps, double last);

class Adam {
 public:
  explicit Adam(std::vector<AdamGroup> groups, AdamOptions options = {});

  // Takes one step from x, given the loss and its gradient there. Returns false if the step was refused; x is then
  // where it was before the last step. For float, the computation is in double.
  bool step(std::span<double> x, double loss, std::span<const double> gradient);
  bool step(std::span<float> x, double loss, std::span<const float> gradient);

  long steps() const { return steps_; }      // taken
  long refused() const { return refused_; }  // by the safeguard
  double rate_factor() const;                // the schedule's factor times the halvings by refusals

  void save(State& state, const std::string& name) const;
  void restore(const State& state, const std::string& name);

 private:
  template <typename T>
  bool step_of(std::span<T> x, double loss, std::span<const T> gradient);
  template <typename T>
  void refuse(std::span<T> x);

  std::vector<AdamGroup> groups_;
  AdamOptions options_;
  std::vector<double> first_, second_, before_;  // moments; the last x with a finite gradient
  long steps_ = 0, refused_ = 0;
  double halvings_ = 1;
  double lowest_ = INFINITY;  // lowest loss so far
};

}  // namespace apps
