// training.h -- what stages are learned from, and a step of it.
//
// A batch is square pieces of photographs' luma at random places, mirrored and turned at random, each blurred by a
// motion path or a disc of its own and with noise of its own strength. Stages are learned one after the other at
// first, each from where the one before it ended, and then all together.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "common/adam.h"
#include "objective.h"

namespace deconvolution {

struct BatchShape {
  int side = 64;  // of what is seen of a piece
  int pieces = 8;
  int psf = 15;  // samples of the largest function

  Extent extent() const { return {side, side, pieces, psf}; }
  bool operator==(const BatchShape&) const = default;
};

class Sampler {
 public:
  // Throws retrograde::UserError where a photograph is smaller than a piece with its margin.
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

// How many steps each stage is learned by itself, and which stages move at a step: the first, the second, ...,
// each for so many steps, then all.
long steps_apart(long steps, int stages);
Range learned_at(long step, long steps_apart, int stages);

class Trainer {
 public:
  struct Options {
    long steps = 1000;
    int threads = 1;
    uint64_t seed = 1;
    std::vector<std::string> groups = group_names;
    bool from_weights = false;  // that were learned: all stages move from the first step on
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
