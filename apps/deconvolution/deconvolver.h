// deconvolver.h -- applies a method to a problem: runs all its stages, which the caller may watch and stop.
#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "solver.h"
#include "weights.h"

namespace deconvolution {

struct Method {
  std::string name;
  Weights weights;
};

// The methods that come with the program: with the original numbers, the tuned ones, and the learned ones.
std::vector<Method> shipped_methods();

inline constexpr Accuracy usual_accuracy{.iterations = 30, .tolerance = 1e-3};

class Deconvolver {
 public:
  Deconvolver(Method method, const Extent& extent, int threads,
              const Accuracy& accuracy = usual_accuracy);

  const std::string& name() const { return method_.name; }
  int iterations() const { return accuracy_.iterations * method_.weights.stages; }  // at most
  const Shape& shape() const { return method_.weights.shape; }
  // Replaces the method by another one whose weights have the same shape.
  void use(Method method) { method_ = std::move(method); }

  // Called before a stage's first iteration and after each one, with the number of iterations so far and the images
  // [count, full height, full width]. Returning false stops, and the images are the result.
  using Watch = std::function<bool(int iterations, const lang::Buffer<float>& images)>;

  // [count, height, width]
  std::vector<float> run(const Problem& problem, const Watch& watch = {});
  // The result of each stage in the last run.
  const std::vector<std::vector<float>>& stages() const { return stages_; }
  bool stopped() const { return stopped_; }  // by its watch, in the last run

 private:
  Method method_;
  Accuracy accuracy_;
  Solver<float> solver_;
  std::vector<std::vector<float>> stages_;
  bool stopped_ = false;
};

}  // namespace deconvolution
