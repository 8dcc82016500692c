// training_pipeline.h -- one step of Adam as a pipeline: loss, gradients, and the next parameters.
//
//   m'  = b1 m + (1 - b1) g          g: the gradient of the loss by propagate_adjoints
//   v'  = b2 v + (1 - b2) g^2
//   p'  = p - rate m' m_scale / (sqrt(v' v_scale) + tiny)
//
// after Kingma and Ba, "Adam: a method for stochastic optimization" (2015), algorithm 1; the caller provides the bias
// corrections m_scale and v_scale, 1 / (1 - b^t).
#pragma once

#include <optional>
#include <vector>

#include "model.h"

namespace bilateral_slice {

// A parameter array with its two moments, which a step reads, and the Func that computes their next values.
struct Learned {
  // `rate` is relative to the step's rate.
  Learned(const lang::ImageParam& value, const lang::Func& gradient, std::vector<lang::Var> at,
          float rate);

  lang::ImageParam value, moment, square;
  lang::Func gradient;
  std::vector<lang::Var> at;
  float rate;
  lang::Func next;  // Tuple of value, moment, square
};

struct TrainingPipeline {
  explicit TrainingPipeline(const Shape& shape, const Groups& moves = {});

  Model model;
  lang::Derivative adjoints;
  lang::Param<float> rate{"rate"}, m_scale{"m_scale"}, v_scale{"v_scale"};
  std::optional<Learned> grid, mix, curve;  // the groups that move
  lang::Pipeline pipeline;                  // outputs: loss, then the next values of each group

 private:
  Learned learn(const lang::ImageParam& value, const lang::Func& parameter,
                std::vector<lang::Var> variables, float rate_factor);
};

// Schedules and compiles it for `threads` threads. Each language has its own file: schedule_retrograde.cpp is manual,
// schedule_halide.cpp uses Halide's Li2018 autoscheduler.
void schedule(TrainingPipeline& training, int threads);

}  // namespace bilateral_slice
