// objective.h -- the training objective: a loss of the last stage's image, and its gradient by the numbers of all
// stages.
//
//   loss = mean over the images of 10 log10(mean of (image - truth)^2 + 0.002), decibels
//
// A stage's image x minimizes its energy, so the gradient g(x; numbers, before) is 0 there. If a number changes, x
// changes so that g stays 0: H dx = -dg. With q, the loss' gradient by x, and H lambda = -q,
//
//   d loss = lambda . dg = d(lambda . g),   lambda held fixed
//
// lambda . g is the energy's tangent along lambda (propagate_tangents); propagate_adjoints gives its gradient by the
// stage's numbers and by the previous image. So a stage costs one more solution, with the same compiled step, and no
// iterates are stored. If solutions are inexact, with residuals r of x and s of lambda, the derivative has errors of
// first order in |r| and |s|; README.md shows how large they are. (Differentiating each iteration would store all
// iterates, and would also differentiate the conjugate gradients' own a and b.)
#pragma once

#include <memory>

#include "simulation.h"
#include "weights.h"

namespace deconvolution {

// The stages whose numbers get a gradient, and the last stage to run.
struct Range {
  int first = 0, last = 0;
};

template <typename T>
class Objective {
 public:
  using Image = std::vector<T>;

  // Compiles the gradient by these arrays of each stage; other arrays have no gradient.
  Objective(const Shape& shape, const Extent& extent, int threads,
            std::vector<Array> arrays = {all_arrays.begin(), all_arrays.end()});

  void set(const Simulated& batch);
  const Accuracy& accuracy() const { return accuracy_; }
  void set(const Accuracy& accuracy) { accuracy_ = accuracy; }

  // `numbers` and `gradient` are those of all stages, one after the other; the gradient by what is not in
  // `learned`, or of other arrays, is 0. Without a gradient only the loss.
  double evaluate(std::span<const T> numbers, std::span<T> gradient, const Range& learned);
  // The image of the last stage, from the last evaluation.
  const Image& image() const { return images_.back(); }

  std::string explain() const { return adjoints_->explain(); }
  size_t stages() const;  // number of Funcs in a stage's gradient
  double compile_seconds() const { return compile_seconds_; }

 private:
  void compile_loss(int threads);
  void compile_slope(int threads);
  double loss_and_gradient(const Image& image, Image& gradient);
  // Adds the gradient by a stage's numbers to `gradient`, and returns the gradient by the previous image.
  Image back_through(const Image& image, const Image& before, const Image& lambda,
                     std::span<T> gradient);

  Extent extent_;
  std::vector<Array> arrays_;
  Solver<T> solver_;
  Stage stage_;
  lang::ImageParam lambda_, truth_, result_;
  std::unique_ptr<lang::Derivative> adjoints_;
  lang::Pipeline loss_, slope_;
  Accuracy accuracy_;
  Image first_;
  std::vector<Image> images_;  // the initial image, then one after each stage
  double compile_seconds_ = 0;
};

extern template class Objective<float>;
extern template class Objective<double>;

}  // namespace deconvolution
