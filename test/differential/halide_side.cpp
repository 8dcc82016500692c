// The pipelines in Halide 14.
#include <Halide.h>

#include <limits>

#include "differential/side.h"

namespace differential {
namespace in_halide {
using namespace Halide;

// Halide 14 treats any machine with AVX512-BF16 as a Sapphire Rapids, and emits instructions that
// others lack.
static Target jit_target() {
  return get_jit_target_from_environment().without_feature(Target::AVX512_SapphireRapids);
}

#include "differential/pipelines/all.h"
}  // namespace in_halide

std::vector<std::string> case_names() {
  std::vector<std::string> names;
  for (const auto& one : in_halide::cases()) names.push_back(one.name);
  return names;
}

std::vector<HostBuffer> run_in_halide(const std::string& name, bool scheduled) {
  return in_halide::realize_built(in_halide::find_case(name).build(scheduled));
}

std::vector<std::string> nest_names() {
  std::vector<std::string> names;
  for (const auto& one : in_halide::nest_cases()) names.push_back(one.name);
  return names;
}

void print_nest_in_halide(const std::string& name) { in_halide::find_nest(name).print_loop_nest(); }

}  // namespace differential
