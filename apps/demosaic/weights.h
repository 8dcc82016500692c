// weights.h -- the learned numbers of relaxed.h as one vector: their initial values, and their file.
#pragma once

#include <retrograde/retrograde.h>

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "relaxed.h"

namespace demosaic {

// The groups for --optimize: green's filters; the parts of scores; the filters of colour with the step towards their
// median.
inline const std::vector<std::string> group_names{"green", "selection", "chroma"};
std::string group_of(Array array);
std::string name_of(Array array);  // in a file of weights

struct Weights {
  // Initial values: filters that interpolate along rows and columns like AHD's, then one-sided, diagonal and plain
  // ones; uniform windows; averages of colour differences.
  explicit Weights(const Shape& shape);

  std::span<float> of(Array array);
  lang::Buffer<float> buffer(Array array);  // the same memory
  void bind(Parameters& parameters);

  Shape shape;
  std::vector<float> values;

 private:
  void start_green();
  void start_cross();
  void start_chroma();
};

// A JSON file with the shape, the origin of the weights, and each array. Throws retrograde::UserError unless the file
// is complete and its numbers are finite.
void write_weights(const std::filesystem::path& path, Weights& weights, const std::string& origin);
Weights read_weights(const std::filesystem::path& path);

}  // namespace demosaic
