// solver.h -- the minimum of a stage's energy by conjugate gradients, compiled once for all stages of a shape.
//
// The energy is quadratic in the image: its gradient g comes from propagate_adjoints, H p, its Hessian times a
// direction, from propagate_tangents of that gradient. Two pipelines are compiled, whatever the number of
// iterations:
//
//   start   r = -g(x) at a first image, and r.r
//   step    x + a p,   r' = r - a H p,   r' + b p,   r'.r'   with a = r.r / p.Hp, b = r'.r' / r.r
//
// (M. Hestenes, E. Stiefel, Methods of conjugate gradients for solving linear systems, Journal of Research of the
// National Bureau of Standards 49, 1952, section 3.) Each image of a batch has its own a and b; products of two
// images are summed in double. The same step solves H lambda = q, which is what learning asks for.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "stage.h"

namespace deconvolution {

// What was seen of some images, as floats whatever the solver computes in.
struct Problem {
  Extent extent;
  std::vector<float> blurred;  // [count, height, width]
  std::vector<float> psfs;     // [count, psf, psf], each of sum 1
  std::vector<float> noises;   // [count], standard deviations
};

// When a solution is good enough: after so many iterations, or when the largest of the images' residuals has
// fallen by this factor.
struct Accuracy {
  int iterations = 40;
  double tolerance = 1e-3;
};

// Copied into a buffer of these sizes, innermost first.
template <typename T, typename From>
lang::Buffer<T> filled(const std::vector<int>& sizes, std::span<const From> values) {
  lang::Buffer<T> buffer(sizes);
  std::copy(values.begin(), values.end(), buffer.begin());
  return buffer;
}

// Gives a stage's images what was seen, and its arrays their numbers, which lie in the order of Array.
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

  // Sees the image before the first iteration and after each; false ends them.
  using Watch = std::function<bool(const lang::Buffer<T>& image)>;

  // A stage after the image `before`, from which it starts, too.
  Image solve(const Image& before, const Accuracy& accuracy, const Watch& watch = {});
  // H lambda = right_side, from lambda = 0.
  Image solve_linear(const Image& right_side, const Accuracy& accuracy);

  double energy(const Image& image, const Image& before);
  int iterations() const { return iterations_; }   // of the last solution
  double reduction() const { return reduction_; }  // of its residual
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

// b with its border repeated over the margin: where the first stage starts.
template <typename T>
std::vector<T> padded(const Problem& problem);
// Without the margin.
template <typename T>
std::vector<float> cropped(const std::vector<T>& image, const Extent& extent);

extern template class Solver<float>;
extern template class Solver<double>;

}  // namespace deconvolution
