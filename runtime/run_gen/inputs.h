// inputs.h -- what stands for a buffer on the command line: a file, or values that are made up.
#pragma once

#include <string>
#include <vector>

#include "run_gen/elements.h"

namespace retrograde::run_gen {

struct Shape {
  std::vector<int> mins, extents;
};

struct BufferSpec {
  enum class Kind { File, Zero, Constant, Identity, Random } kind = Kind::File;
  std::string path;      // File
  std::string constant;  // Constant
  uint64_t seed = 0;     // Random
  // Of made-up values: tried in this order. Exactly one of them for [3,4].
  bool from_estimate = false, from_query = false;
  std::vector<int> extents;
};

// "zero:[3,4]", "random:7:auto", "photo.png". Problem when it cannot be read.
BufferSpec read_buffer_spec(const std::string& text);
// The estimates of the argument; an empty shape when the generator says none.
Shape estimated_shape(const halide_filter_argument_t& argument);
void fill(Image& image, const BufferSpec& spec);

}  // namespace retrograde::run_gen
