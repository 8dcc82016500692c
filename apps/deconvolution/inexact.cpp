// inexact.cpp -- see inexact.h.
#include "inexact.h"

#include <cmath>
#include <span>

#include "training.h"

namespace deconvolution {

namespace {

constexpr BatchShape batch_shape{.side = 32, .pieces = 2, .psf = 9};
constexpr int many_iterations = 1500;  // enough for ten exact digits
constexpr int directions = 12;

class Comparison {
 public:
  Comparison(const std::vector<demosaic::Photograph>& photographs, const Weights& weights,
             uint64_t seed, int threads)
      : stages_(weights.stages),
        at_(weights.values.begin(), weights.values.end()),
        objective_(weights.shape, batch_shape.extent(), threads) {
    objective_.set(Sampler(photographs, seed).draw(batch_shape));
    Random random(seed);
    for (int k = 0; k < directions; ++k) directions_.push_back(direction(random, k));
    exact_ = implicit(many_iterations);
  }

  std::vector<nlohmann::json> row(int iterations) {
    const auto own = implicit(iterations), by_differences = differences(iterations);
    return {iterations, rounded(error(own, by_differences)), rounded(error(own, exact_)),
            rounded(error(by_differences, exact_))};
  }

 private:
  using Slopes = std::vector<double>;  // derivatives of the loss along each direction

  // Moves numbers of one stage, each by a fraction of its size or, near 0, of the size of the stage's other numbers.
  std::vector<double> direction(Random& random, int k) const {
    const size_t each = at_.size() / static_cast<size_t>(stages_);
    const size_t from = static_cast<size_t>(k % stages_) * each;
    std::vector<double> result(at_.size(), 0.0);
    for (size_t j = from; j < from + each; ++j) {
      result[j] = random.uniform(-1, 1) * (std::abs(at_[j]) + 0.01);
    }
    return result;
  }

  Slopes implicit(int iterations) {
    objective_.set(Accuracy{iterations, 1e-14});
    std::vector<double> gradient(at_.size());
    objective_.evaluate(std::span<const double>(at_), gradient, {0, stages_ - 1});
    Slopes slopes;
    for (const auto& direction : directions_) {
      double slope = 0;
      for (size_t j = 0; j < gradient.size(); ++j) slope += gradient[j] * direction[j];
      slopes.push_back(slope);
    }
    return slopes;
  }

  Slopes differences(int iterations) {
    constexpr double step = 1e-5;
    objective_.set(Accuracy{iterations, 1e-14});
    Slopes slopes;
    for (const auto& direction : directions_) {
      const auto loss_at = [&](double move) {
        std::vector<double> moved = at_;
        for (size_t j = 0; j < moved.size(); ++j) moved[j] += move * direction[j];
        return objective_.evaluate(std::span<const double>(moved), {}, {0, stages_ - 1});
      };
      slopes.push_back((loss_at(step) - loss_at(-step)) / (2 * step));
    }
    return slopes;
  }

  static double error(const Slopes& a, const Slopes& b) {
    double off = 0, size = 0;
    for (size_t k = 0; k < a.size(); ++k) {
      off += (a[k] - b[k]) * (a[k] - b[k]);
      size += b[k] * b[k];
    }
    return std::sqrt(off / size);
  }
  static double rounded(double value) { return std::stod(retrograde::text(value)); }

  int stages_;
  std::vector<double> at_;
  Objective<double> objective_;
  std::vector<std::vector<double>> directions_;
  Slopes exact_;
};

}  // namespace

apps::Table inexact_solutions(const std::vector<demosaic::Photograph>& photographs,
                              const Weights& weights, uint64_t seed, int threads) {
  Comparison comparison(photographs, weights, seed, threads);
  apps::Table table{"gradients of solutions that are not exact",
                    {"iterations of a stage", "implicit against differences of the same",
                     "implicit against exact", "differences against exact"},
                    {}};
  for (const int iterations : {10, 15, 20, 40, 80}) {
    table.rows.push_back(comparison.row(iterations));
  }
  return table;
}

}  // namespace deconvolution
