// reference.h -- a slow reference for tests: a stage in plain C++ and double.
#pragma once

#include <span>
#include <vector>

#include "solver.h"
#include "weights.h"

namespace deconvolution {

// Numbers of one stage in the order of Array; images are [count, full height, full width].
struct Reference {
  Reference(const Shape& shape, const Problem& problem, std::span<const float> numbers);

  std::vector<double> cleaned(const std::vector<double>& before) const;
  // [count, filters, rows, columns], for positions at which the filters lie within the image.
  std::vector<double> target(const std::vector<double>& before) const;
  double energy(const std::vector<double>& image, const std::vector<double>& before) const;
  // The gradient by the image, derived by hand.
  std::vector<double> gradient(const std::vector<double>& image,
                               const std::vector<double>& before) const;
  // Conjugate gradients on the gradient above, until the residual vanishes.
  std::vector<double> minimum(const std::vector<double>& before) const;

 private:
  using Doubles = std::vector<double>;
  size_t at(int x, int y, int n) const;
  size_t inner(int x, int y, int f, int n) const;
  double filter(int u, int v, int f) const;
  double weight(int f, int n) const;
  double shrunk(double d, int f) const;
  Doubles responses(const Doubles& image) const;
  Doubles residual(const Doubles& image) const;
  Doubles gradient_of(const Doubles& residual, const Doubles& miss) const;

  Shape shape_;
  const Problem& problem_;
  Extent extent_;
  int rows_, columns_;  // of responses
  Doubles filters_, log_weights_, shrinkage_, smoothing_;
};

}  // namespace deconvolution
