// kernel_report.h -- what the kernels of a schedule with gpu_ directives take of a device.
//
//   std::cout << explain_kernels(pipeline, target).to_string();
//
// Registers, stack and spills are known where NVIDIA's assembler, ptxas, is installed.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "ir/target.h"

namespace retrograde {

class Pipeline;

struct KernelReport {
  struct Kernel {
    std::string name;                     // of its launch
    std::vector<std::string> loops;       // by stage: "out: blocks y, x, threads yi, xi"
    int threads = 0;                      // of a block
    std::optional<int64_t> shared_bytes;  // of a block; none: the call decides
    int64_t local_bytes = 0;              // of a thread: of arrays that found no registers
    // As ptxas says; of a thread.
    std::optional<int> registers;
    std::optional<int64_t> stack_bytes, spill_bytes;
  };
  std::vector<Kernel> kernels;     // in the order of their launches
  std::string assembler;           // "ptxas 13.0.88 for sm_80", or why its figures are missing
  std::vector<std::string> notes;  // performance notes

  std::string to_string() const;  // empty where there are no kernels
  std::string to_json() const;
};

// No kernels for schedules of the host alone. Errors: those of compiling.
KernelReport explain_kernels(const Pipeline& pipeline, const Target& target);

}  // namespace retrograde
