// program_sizes.h -- what a lowered function is called with, as far as its cost depends on it: shapes of
// buffers, values of scalars.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "graph/function.h"
#include "ir/lowered_function.h"

struct halide_buffer_t;

namespace retrograde::tuning {

struct BufferShape {
  struct Dim {
    int64_t min = 0, extent = 1, stride = 1;
  };
  std::vector<Dim> dims;
  int element_bytes = 1;
  double bytes() const;
};

struct ProgramSizes {
  std::map<std::string, BufferShape> buffers;  // by the names of arguments
  std::map<std::string, double> scalars;
};

// Of the values of all outputs, in their order: the given sizes (one list for all, or one for each Func),
// else what is known of their bounds and estimates, else a guess.
// Requires: sizes are given once for all outputs, or for each, one for each dimension.
std::vector<BufferShape> output_shapes(const std::vector<FuncPtr>& outputs,
                                       const std::vector<std::vector<int>>& sizes = {});

// Of images and scalars: what is bound, else estimates, else the extents of the first output, and 0.
ProgramSizes program_sizes(const LoweredFunction& function,
                           const std::vector<BufferShape>& outputs);
BufferShape shape_of(const halide_buffer_t& buffer);

}  // namespace retrograde::tuning
