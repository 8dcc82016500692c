// evaluator.h -- the objective compiled: the loss and its gradient by what may move.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "objective.h"

namespace burst {

// What may move; what does not has no adjoint in what is compiled.
struct Moves {
  bool image = true, homographies = true;
};

// What of the whole method is not in the compiled code, and why; a line each.
std::vector<std::string> left_out(const Shape& shape, const Smoothness& smoothness,
                                  const Moves& moves);

// T: float, or double for checks.
template <typename T>
class Evaluator {
 public:
  // Compiled for what of the smoothness there is; its weights may change.
  Evaluator(const Shape& shape, const Smoothness& smoothness, const Moves& moves, int threads);

  const Shape& shape() const { return shape_; }
  size_t size() const { return shape_.image_elems() + shape_.motion_elems(); }

  void set_frames(std::span<const float> samples);  // [frames, height, width]
  // Other weights of the same axes.
  void set_smoothness(const Smoothness& smoothness);

  // x: the picture [3, height, width], then the homographies [frames, 8]; the gradient alike. Of what does not
  // move, and of the first homography, it is 0.
  double evaluate(std::span<T> x, std::span<T> gradient);

  std::string explain() const { return adjoints_.explain(); }
  double compile_seconds() const { return compile_seconds_; }

 private:
  lang::Derivative differentiate() const;
  std::vector<lang::Func> outputs() const;
  std::vector<int> image_sizes() const { return {shape_.size.width, shape_.size.height, 3}; }
  std::vector<int> motion_sizes() const { return {homography_params, shape_.frames}; }

  Shape shape_;
  Moves moves_;
  Objective objective_;
  lang::Derivative adjoints_;
  lang::Pipeline pipeline_;
  double compile_seconds_ = 0;
};

extern template class Evaluator<float>;
extern template class Evaluator<double>;

}  // namespace burst
