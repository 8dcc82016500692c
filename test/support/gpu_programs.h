// gpu_programs.h -- programs with manual GPU schedules, from single operators to complete pipelines.
#pragma once

#include <retrograde/retrograde.h>

#include <functional>
#include <ostream>
#include <string>
#include <vector>

namespace gpu_programs {

struct Program {
  std::string name;
  // Builds the Func, with its GPU schedule or unscheduled.
  std::function<retrograde::Func(bool on_gpu)> build;
  std::vector<int> sizes;
  bool is_streaming = false;  // each kernel reads and stores rows: then sectors of memory are few
  // The lower bounds at these sizes: bytes of inputs and outputs, and numbers of products and sums.
  double bytes = 0, operations = 0;
  int timing_scale = 1;  // at which a large device has enough to do
};

inline void PrintTo(const Program& program, std::ostream* out) { *out << program.name; }

// All programs at the size for tests, or larger by a factor in each dimension.
std::vector<Program> all(int scale = 1);
Program named(const std::string& name, int scale = 1);
// The sum of this many values: first in each thread, then over the threads of a block, then over all blocks.
Program reduction(int values);
float reduced_value(int i);

}  // namespace gpu_programs
