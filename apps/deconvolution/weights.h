// weights.h -- the numbers of all stages as one vector: their initial values, and their file.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "stage.h"

namespace deconvolution {

// The groups for --optimize.
inline const std::vector<std::string> group_names{"filters", "weights", "shrinkage", "smoothing"};
std::string name_of(Array array);  // the same words
std::vector<Array> arrays_of(const std::vector<std::string>& groups);

struct Weights {
  Weights(const Shape& shape, int stages);

  std::span<float> of(int stage);
  std::span<const float> of(int stage) const;
  std::span<float> of(int stage, Array array);
  float& filter(int stage, int f, int u, int v);

  Shape shape;
  int stages;
  std::vector<float> values;
};

// The published numbers of Fortunato and Oliveira, section 4: two stages with five derivatives, lambda 0.001 and 0.05,
// thresholds 0.065 for first and 0.0325 for second derivatives.
struct Priors {
  double first_weight = 0.001, second_weight = 0.05;
  double first_threshold = 0.065, second_threshold = 0.0325;
  double mix = 1;  // weight of the cleaned image, see cleaning.h
};
Weights original(const Priors& priors = {});

// The initial weights for learning: the derivatives of the original method, then cosines over 5 x 5 samples, with
// mixtures that shrink approximately like its thresholds.
Weights learning_start(const Shape& shape, int stages);

// A JSON file with the shape, the origin of the weights, and each array. Throws retrograde::UserError unless the file
// is complete and its numbers are finite.
void write_weights(const std::filesystem::path& path, const Weights& weights,
                   const std::string& origin);
Weights read_weights(const std::filesystem::path& path);

// The weights that come with the program, from its folder or where they are installed: four learned stages, and the
// original method with numbers tuned by a scan. Throws retrograde::UserError.
Weights learned_weights();
Weights tuned_weights();

}  // namespace deconvolution
