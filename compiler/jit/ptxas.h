// ptxas.h -- NVIDIA's assembler, where it is installed: PTX as machine code of a chip, and what each kernel
// takes of the chip. Nothing needs it: the driver assembles, too, and says nothing of it.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

namespace retrograde::jit {

// What RETROGRADE_PTXAS names, where it is set (nothing names no program); else "ptxas" in the folders of
// PATH, then in $CUDA_HOME/bin and /usr/local/cuda/bin. Empty: there is none.
std::string find_ptxas();

// As it says it: "13.0.88". Empty where it does not run.
std::string ptxas_version(const std::string& program);

struct KernelFigures {
  int registers = 0;        // of a thread
  int64_t stack_bytes = 0;  // of a thread, in local memory
  int64_t spill_store_bytes = 0, spill_load_bytes = 0;
};

struct Assembly {
  std::string image;                             // a cubin
  std::map<std::string, KernelFigures> kernels;  // by symbol
  std::string problem;  // what the assembler says; then nothing else is there
};

// The oldest that it knows is 7.5.
int assembled_capability(int capability);
// For devices of this compute capability (80: 8.0), or of the oldest.
Assembly assemble(const std::string& program, const std::string& ptx, int capability);

// What the assembler tells with --verbose.
std::map<std::string, KernelFigures> figures_in(const std::string& told);

}  // namespace retrograde::jit
