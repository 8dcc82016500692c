// evaluator.h -- the compiled objective: the loss and its gradient by the variables that move.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "objective.h"

namespace burst {

// Which variables are optimized; the others have no adjoint in the compiled code.
struct Moves {
  bool image = true, homographies = true;
};

// The parts of the method that the compiled code leaves out, and why; one line each.
std::vector<std::string> left_out(const Shape& shape, const Smoothness& smoothness,
                                  const Moves& moves);

// T: float, or double for checks.
template <typename T>
class Evaluator {
 public:
  // Compiled for the given terms of the smoothness; their weights may change later.
  Evaluator(const Shape& shape, const Smoothness& smoothness, const Moves& moves, int threads);

  const Shape& shape() const { return shape_; }
  size_t size() const { return shape_.image_elems() + shape_.motion_elems(); }

  void set_frames(std::span<const float> samples);  // [frames, height, width]
  // Changes the weights; the axes must stay the same.
  void set_smoothness(const Smoothness& smoothness);

  // x: the picture [3, height, width], then the homographies [frames, 8]; the gradient has the same layout. The
  // gradient is 0 for variables that do not move, and for the first homography.
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
