// minimize.h -- one interface to all optimizers of a smooth function of many variables.
//
//   adam                Adam (adam.h)
//   lbfgs               L-BFGS with a Wolfe line search, by Ceres (S. Agarwal, K. Mierle)
//   conjugate_gradient  non-linear conjugate gradients (Polak-Ribiere), by Ceres
//   newton_cg           truncated Newton: J. Nocedal, S. Wright, Numerical Optimization, 2nd edition,
//                       algorithm 7.1, on Hessian-vector products
//
// All of them stop after a number of steps or seconds, when the gradient is small, or when the callback or a signal
// says so (stop.h). They return the best point that was met. A step to values that are not finite is shortened and
// counted as refused.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "common/adam.h"

namespace apps {

struct Problem {
  size_t size = 0;
  // The loss at x, and also its gradient unless `gradient` is empty.
  std::function<double(std::span<const double> x, std::span<double> gradient)> evaluate = {};
  // H(x) v; only needed for newton_cg.
  std::function<void(std::span<const double> x, std::span<const double> v,
                     std::span<double> product)>
      hessian_product = {};
};

enum class Method { Adam, Lbfgs, ConjugateGradient, NewtonCg };
std::string name_of(Method method);  // "adam", "lbfgs", "conjugate_gradient", "newton_cg"
// Throws retrograde::UserError for any other name.
Method method_named(const std::string& name);

struct MinimizeOptions {
  Method method = Method::Lbfgs;
  long steps = 100;
  double seconds = 0;                 // 0: no limit
  double gradient_tolerance = 1e-10;  // for the gradient's largest element
  double loss_tolerance = 0;          // relative change over a step; 0: no limit
  double rate = 1e-2;                 // for Adam
  int memory = 20;                    // number of steps that L-BFGS remembers
  AdamOptions adam = {};
  bool safeguard = true;  // false only for demonstrations without it
  Adam* moments =
      nullptr;  // Adam continues with these moments, which the caller saves; their steps count
};

// The loss after a step (0: at the start) and the seconds since the start.
struct LossSample {
  long step;
  double seconds;
  double loss;
};

struct Minimum {
  std::vector<double> x;  // the best point, and its loss
  double loss = 0;
  std::vector<LossSample> series;  // one per step
  long steps = 0, evaluations = 0, products = 0, refused = 0;
  double seconds = 0;
  bool stopped = false;  // by a signal
  std::string ended;     // the reason, in words
};

// Called after each step with the best point so far; returning false ends the run.
using StepCallback = std::function<bool(const LossSample& sample, std::span<const double> best)>;

// Throws retrograde::UserError if the loss is not finite at the start.
Minimum minimize(const Problem& problem, std::span<const double> start,
                 const MinimizeOptions& options, const StepCallback& callback = {});

}  // namespace apps
