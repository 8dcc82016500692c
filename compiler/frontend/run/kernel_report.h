// kernel_report.h -- device resources that the GPU kernels of a schedule use.
//
//   std::cout << explain_kernels(pipeline, target).to_string();
//
// Registers, stack and spills are known only if NVIDIA's assembler, ptxas, is installed.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "ir/target.h"

namespace retrograde {

class Pipeline;

// The kernels of a compiled schedule and the device resources that they use.
struct KernelReport {
  // One kernel, with the resources of a block and of a thread.
  struct Kernel {
    std::string name;                     // name of the launch
    std::vector<std::string> loops;       // one line per stage: "out: blocks y, x, threads yi, xi"
    int threads = 0;                      // threads in a block
    std::optional<int64_t> shared_bytes;  // of a block; none: depends on the call
    int64_t local_bytes = 0;              // of a thread: arrays that do not fit registers
    // Registers of a thread, as ptxas reports.
    std::optional<int> registers;
    std::optional<int64_t> stack_bytes, spill_bytes;  // of a thread, as ptxas reports
  };
  std::vector<Kernel> kernels;     // in launch order
  std::string assembler;           // "ptxas 13.0.88 for sm_80", or why there is none
  std::vector<std::string> notes;  // performance notes

  std::string to_string() const;  // a table; empty if there are no kernels
  std::string to_json() const;    // the same data as JSON
};

// Compiles the pipeline and reports its kernels; a schedule for the CPU has none. Throws what compiling
// throws.
KernelReport explain_kernels(const Pipeline& pipeline, const Target& target);

}  // namespace retrograde
