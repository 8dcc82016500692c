// trainer.h -- fits the look to a pair of images, step by step.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "training_pipeline.h"

namespace bilateral_slice {

class Trainer {
 public:
  // photo: [coefficients, height, width], target: [channels, height, width]; both must outlive the trainer. The initial
  // look is the identity, with the mean of the colours as guide.
  Trainer(const Shape& shape, float* photo, float* target, int threads, const Groups& moves = {});

  // Replaces the pair by another one of the same shape.
  void set_pair(float* photo, float* target);

  // One step of Adam at this rate. Returns the loss before it.
  double step(float rate);

  const Shape& shape() const { return training_.model.shape; }
  const lang::Derivative& adjoints() const { return training_.adjoints; }
  Groups moves() const;

  using Buffer = lang::Buffer<float>;
  const Buffer& grid() const { return grid_[now_].value; }
  const Buffer& mix() const { return mix_[now_].value; }
  const Buffer& curve() const { return curve_[now_].value; }

  // All inputs of the next step: grid, mix and curve, each with its two moments, which are undefined for groups that do
  // not move. After filling them in, call set_steps with the number of steps that led there.
  std::vector<Buffer> state() const;
  int steps() const { return steps_; }
  void set_steps(int steps) { steps_ = steps; }

 private:
  struct Moments {
    Buffer value, moment, square;
  };
  // A step reads one copy and writes the other; for groups that do not move, both are the same.
  using State = std::array<Moments, 2>;

  static State zeros(const std::vector<int>& sizes, bool moves);
  void start_from_identity();
  void bind(lang::ImageParam& value, std::optional<Learned>& learned, const State& state);

  TrainingPipeline training_;
  Buffer photo_, target_, loss_;
  State grid_, mix_, curve_;
  int now_ = 0;
  int steps_ = 0;
};

}  // namespace bilateral_slice
