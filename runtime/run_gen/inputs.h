// inputs.h -- buffer arguments on the command line: a file, or generated values.
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
  // Sources of the shape of generated values, in the order in which they are tried. [3,4] sets exactly one.
  bool from_estimate = false, from_query = false;
  std::vector<int> extents;
};

// Parses "zero:[3,4]", "random:7:auto", "photo.png". Throws Problem if that fails.
BufferSpec read_buffer_spec(const std::string& text);
// The argument's estimates; an empty shape if the generator gives none.
Shape estimated_shape(const halide_filter_argument_t& argument);
void fill(Image& image, const BufferSpec& spec);

}  // namespace retrograde::run_gen
