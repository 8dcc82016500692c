// weights.h -- the learned numbers of relaxed.h as one vector, where they begin, and their file.
#pragma once

#include <retrograde/retrograde.h>

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "relaxed.h"

namespace demosaic {

// What --optimize names: the filters of green; what scores are made of; the filters of colour and the step
// towards their median.
inline const std::vector<std::string> group_names{"green", "selection", "chroma"};
std::string group_of(Array array);
std::string name_of(Array array);  // in a file of weights

struct Weights {
  // Filters that interpolate along rows and columns as AHD's do, then one-sided, diagonal and plain
  // ones; windows that weigh all alike; averages of colour differences.
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

// A JSON file with the shape, who learned it from what, and each array. Throws retrograde::UserError
// unless it is one, whole, of finite numbers.
void write_weights(const std::filesystem::path& path, Weights& weights, const std::string& origin);
Weights read_weights(const std::filesystem::path& path);

}  // namespace demosaic
