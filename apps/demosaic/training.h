// training.h -- the training objective, its data, and one training step.
//
//   loss = mean over the pixels of a batch and their three colours of (image - truth)^2
//
// A batch consists of square pieces of photographs at random positions, randomly mirrored and turned and with randomly
// changed colours; only then are they sampled as a mosaic. The cells that count are surrounded by the margin that they
// read.
#pragma once

#include <retrograde/retrograde.h>

#include <array>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "common/adam.h"
#include "common/options.h"
#include "photographs.h"
#include "weights.h"

namespace demosaic {

struct BatchShape {
  int cells = 48;  // along each side
  int pieces = 6;
};

// Pieces of photographs: the samples that a sensor sees, with a margin, and the truth.
struct Batch {
  Batch(const Shape& shape, const BatchShape& batch);

  int margin;                  // samples around the cells that count
  lang::Buffer<float> mosaic;  // [pieces, side, side], min -margin along x and y
  lang::Buffer<float> truth;   // [pieces, 3, 2 cells, 2 cells]
};

// The model on a batch, and its loss.
struct Objective {
  Objective(const Shape& shape, const BatchShape& batch, lang::Type scalar = lang::Float(32));
  void bind(const Batch& batch);

  BatchShape batch;
  lang::ImageParam mosaic, truth;
  Relaxed model;
  lang::Func loss{"loss"};

 private:
  lang::Func seen() const;
};

// The loss and its gradient by the arrays of some groups.
struct TrainingPipeline {
  TrainingPipeline(const Shape& shape, const BatchShape& batch,
                   const std::vector<std::string>& groups);
  void compile(int threads);
  size_t stages() const;  // number of Funcs in the gradient

  std::vector<Array> learned;  // arrays of the groups
  Objective objective;
  lang::Derivative adjoints;
  lang::Pipeline pipeline;  // loss, then the gradient by each of `learned`

 private:
  lang::Derivative differentiate() const;
};

// Draws batches.
class Sampler {
 public:
  Sampler(const std::vector<Photograph>& photographs, uint64_t seed);

  Batch draw(const Shape& shape, const BatchShape& batch);
  std::mt19937_64& random() { return random_; }

 private:
  struct Piece;
  using ColourMatrix = std::array<std::array<float, 3>, 3>;  // [to, from]
  Piece piece(int side);
  ColourMatrix other_colours();
  size_t below(size_t n);
  float between(float least, float most);

  const std::vector<Photograph>& photographs_;
  std::mt19937_64 random_;
};

class Trainer {
 public:
  struct Options {
    apps::CommonOptions common;  // steps, threads, seed, and the groups to optimize
    BatchShape batch = {};
  };
  // The photographs must outlive it.
  Trainer(const Weights& start, const std::vector<Photograph>& photographs, const Options& options);

  // Returns the loss before the step.
  double step();
  const Weights& weights() const { return weights_; }
  const apps::Adam& adam() const { return adam_; }
  size_t stages() const { return training_.stages(); }

  void save(apps::State& state);
  void restore(const apps::State& state);

 private:
  Weights weights_, gradient_;
  BatchShape batch_;
  TrainingPipeline training_;
  Sampler sampler_;
  apps::Adam adam_;
  lang::Buffer<float> loss_;
};

}  // namespace demosaic
