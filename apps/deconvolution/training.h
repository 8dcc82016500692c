// training.h -- the training data of the stages, and a training step.
//
// A batch consists of square pieces of photographs' luma at random positions, randomly mirrored and turned. Each piece
// is blurred by its own motion path or disc, and has its own noise level. At first, stages are learned one after
// another, each starting from the previous one; then they are learned together.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "common/adam.h"
#include "common/options.h"
#include "objective.h"

namespace deconvolution {

struct BatchShape {
  int side = 64;  // of the visible part of a piece
  int pieces = 8;
  int psf = 15;  // samples of the largest blur function

  Extent extent() const { return {side, side, pieces, psf}; }
  bool operator==(const BatchShape&) const = default;
};

class Sampler {
 public:
  // Throws retrograde::UserError if a photograph is smaller than a piece with its margin.
  Sampler(const std::vector<demosaic::Photograph>& photographs, uint64_t seed);

  Simulated draw(const BatchShape& shape);
  std::mt19937_64& engine() { return random_.engine(); }

 private:
  Plane piece(int side);
  Psf psf(int size);

  std::vector<Plane> planes_;
  std::vector<std::string> names_;
  Random random_;
};

// The number of steps in which each stage is learned by itself, and the stages that are learned at a step: first,
// second, ... for that many steps each, then all.
long steps_apart(long steps, int stages);
Range learned_at(long step, long steps_apart, int stages);

class Trainer {
 public:
  struct Options {
    apps::CommonOptions common;  // steps, threads, seed, and the groups to optimize
    bool from_weights =
        false;  // starting from learned weights: all stages are learned from the first step on
    BatchShape batch = {};
    Accuracy accuracy = {.iterations = 15, .tolerance = 1e-4};
  };
  Trainer(const Weights& start, const std::vector<demosaic::Photograph>& photographs,
          const Options& options);

  // Returns the loss before the step.
  double step();
  const Weights& weights() const { return weights_; }
  const apps::Adam& adam() const { return *adam_; }
  std::string explain() const { return objective_->explain(); }
  double compile_seconds() const { return objective_->compile_seconds(); }

  void save(apps::State& state) const;
  void restore(const apps::State& state);

 private:
  void begin_stage(int stage);

  Options options_;
  long apart_, step_ = 0;
  Weights weights_;
  std::vector<float> gradient_;
  mutable Sampler sampler_;
  std::unique_ptr<Objective<float>> objective_;
  std::unique_ptr<apps::Adam> adam_;
};

}  // namespace deconvolution
