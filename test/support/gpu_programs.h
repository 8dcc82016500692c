// gpu_programs.h -- programs with GPU schedules as a user writes them, from small to whole pipelines.
#pragma once

#include <retrograde/retrograde.h>

#include <functional>
#include <ostream>
#include <string>
#include <vector>

namespace gpu_programs {

struct Program {
  std::string name;
  // The Func, with its schedule for a GPU or with none at all.
  std::function<retrograde::Func(bool on_gpu)> build;
  std::vector<int> sizes;
  bool is_streaming = false;  // each kernel reads and stores rows: then sectors of memory are few
  // What it cannot do without at these sizes: bytes of its inputs and outputs; products and sums.
  double bytes = 0, operations = 0;
  int timing_scale = 1;  // at which a large device has enough to do
};

inline void PrintTo(const Program& program, std::ostream* out) { *out << program.name; }

// As tests have them, or larger by a factor in each dimension.
std::vector<Program> all(int scale = 1);
Program named(const std::string& name, int scale = 1);
// The sum of this many values: in each thread, over the threads of a block, over all blocks.
Program reduction(int values);
float reduced_value(int i);

}  // namespace gpu_programs
