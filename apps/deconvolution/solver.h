// solver.h -- minimizes a stage's energy by conjugate gradients, compiled once for all stages of a shape.
//
// The energy is quadratic in the image. Its gradient g comes from propagate_adjoints; H p, its Hessian times a
// direction, comes from propagate_tangents of that gradient. Two pipelines are compiled, whatever the number of
// iterations:
//
//   start   r = -g(x) at a first image, and r.r
//   step    x + a p,   r' = r - a H p,   r' + b p,   r'.r'   with a = r.r / p.Hp, b = r'.r' / r.r
//
// (M. Hestenes, E. Stiefel, Methods of conjugate gradients for solving linear systems, Journal of Research of the
// National Bureau of Standards 49, 1952, section 3.) Each image of a batch has its own a and b; products of two images
// are summed in double. The same step solves H lambda = q, which learning needs.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "stage.h"

namespace deconvolution {

// The observed images, always as floats.
struct Problem {
  Extent extent;
  std::vector<float> blurred;  // [count, height, width]
  std::vector<float> psfs;     // [count, psf, psf], each of sum 1
  std::vector<float> noises;   // [count], standard deviations
};

// Stopping criterion: a number of iterations, or a factor by which the largest residual among the images has fallen.
struct Accuracy {
  int iterations = 40;
  double tolerance = 1e-3;
};

// Copies values to a buffer of these sizes, innermost first.
template <typename T, typename From>
lang::Buffer<T> filled(const std::vector<int>& sizes, std::span<const From> values) {
  lang::Buffer<T> buffer(sizes);
  std::copy(values.begin(), values.end(), buffer.begin());
  return buffer;
}

// Binds the observations to a stage's image inputs, and the numbers, in the order of Array, to its arrays.
template <typename T>
void bind_problem(Stage& stage, const Problem& problem);
template <typename T>
void bind_numbers(Stage& stage, std::span<const T> numbers);

template <typename T>
class Solver {
 public:
  using Image = std::vector<T>;  // [count, full height, full width]

  Solver(const Shape& shape, const Extent& extent, int threads);

  const Shape& shape() const { return stage_.shape; }
  const Extent& extent() const { return stage_.extent; }
  void set(const Problem& problem) { bind_problem<T>(stage_, problem); }
  void set(std::span<const T> numbers) { bind_numbers<T>(stage_, numbers); }

  // Called with the image before the first iteration and after each one; returning false ends the iterations.
  using Watch = std::function<bool(const lang::Buffer<T>& image)>;

  // Solves the stage that follows the image `before`, which is also the initial point.
  Image solve(const Image& before, const Accuracy& accuracy, const Watch& watch = {});
  // Solves H lambda = right_side, starting from lambda = 0.
  Image solve_linear(const Image& right_side, const Accuracy& accuracy);

  double energy(const Image& image, const Image& before);
  int iterations() const { return iterations_; }   // of the last solution
  double reduction() const { return reduction_; }  // factor by which its residual fell
  double compile_seconds() const { return compile_seconds_; }

 private:
  struct Vectors {
    lang::Buffer<T> x, r, p;
    lang::Buffer<double> square;
  };
  Vectors vectors() const;
  lang::Func sum_of_products(const lang::Func& a, const lang::Func& b, const char* name) const;
  void compile_start(int threads);
  void compile_step(int threads);
  Image iterate(Vectors at, const Accuracy& accuracy, const Watch& watch = {});
  std::vector<int> sizes() const;

  Stage stage_;
  lang::ImageParam x_, r_, p_, square_;
  lang::Pipeline start_, step_, energy_;
  int iterations_ = 0;
  double reduction_ = 1, compile_seconds_ = 0;
};

// b with its border repeated over the margin: the initial image of the first stage.
template <typename T>
std::vector<T> padded(const Problem& problem);
// Removes the margin.
template <typename T>
std::vector<float> cropped(const std::vector<T>& image, const Extent& extent);

extern template class Solver<float>;
extern template class Solver<double>;

}  // namespace deconvolution
