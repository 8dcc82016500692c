// Programs like those of the suite, at sizes at which their gradients run in parallel; these are the ones measured.
#pragma once

#include <span>

#include "gradient/programs_suite.h"

namespace retrograde::gradient {

constexpr int test_side = 160;

struct LargeProgram {
  const char* name;
  Program (*build)(int side);  // images are side by side, lines as long as these have elements
  int least_iterations;  // iterations of the longest parallel loop of its gradients, at test_side
};

std::span<const LargeProgram> large_programs();

}  // namespace retrograde::gradient
