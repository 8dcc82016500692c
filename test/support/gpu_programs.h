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
};

inline void PrintTo(const Program& program, std::ostream* out) { *out << program.name; }

std::vector<Program> all();
// The sum of so many values: of each thread, of a block's threads, of all.
Program reduction(int values);
float reduced_value(int i);

}  // namespace gpu_programs
