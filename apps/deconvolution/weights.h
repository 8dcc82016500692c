// weights.h -- the numbers of all stages as one vector, where they begin, and their file.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "stage.h"

namespace deconvolution {

// What --optimize names.
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

// What Fortunato and Oliveira publish, section 4: two stages with five derivatives, lambda 0.001 and 0.05,
// thresholds 0.065 of first and 0.0325 of second derivatives.
struct Priors {
  double first_weight = 0.001, second_weight = 0.05;
  double first_threshold = 0.065, second_threshold = 0.0325;
  double mix = 1;  // of the cleaned image, see cleaning.h
};
Weights original(const Priors& priors = {});

// Where learning starts: the derivatives of the original, then cosines over 5 x 5 samples, with a mixture that
// shrinks about as the thresholds do.
Weights learning_start(const Shape& shape, int stages);

// A JSON file with the shape, who learned it from what, and each array. Throws retrograde::UserError
// unless it is one, whole, of finite numbers.
void write_weights(const std::filesystem::path& path, const Weights& weights,
                   const std::string& origin);
Weights read_weights(const std::filesystem::path& path);

// What comes with the program, from beside it or where it is installed: four stages as learned, and the original
// method with its numbers tuned by a scan. Throws retrograde::UserError.
Weights learned_weights();
Weights tuned_weights();

}  // namespace deconvolution
