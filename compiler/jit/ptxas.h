// ptxas.h -- runs NVIDIA's assembler, if it is installed. It gives the machine code of a chip for PTX, and the
// resources that each kernel needs. It is optional: the driver assembles too, but reports no resources.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

namespace retrograde::jit {

// The program that RETROGRADE_PTXAS names, if that is set (an empty value means none). Otherwise "ptxas" in the folders
// of PATH, then in $CUDA_HOME/bin and /usr/local/cuda/bin. Empty if not found.
std::string find_ptxas();

// As it prints it: "13.0.88". Empty if it does not run.
std::string ptxas_version(const std::string& program);

struct KernelFigures {
  int registers = 0;        // per thread
  int64_t stack_bytes = 0;  // per thread, in local memory
  int64_t spill_store_bytes = 0, spill_load_bytes = 0;
};

struct Assembly {
  std::string image;                             // a cubin
  std::map<std::string, KernelFigures> kernels;  // by symbol
  std::string problem;  // the assembler's error message; if set, the rest is empty
};

// The capability to assemble for; the oldest that ptxas knows is 7.5.
int assembled_capability(int capability);
// Assembles for devices of this compute capability (80 means 8.0), or for the oldest that ptxas knows.
Assembly assemble(const std::string& program, const std::string& ptx, int capability);

// Parses the output of ptxas --verbose.
std::map<std::string, KernelFigures> figures_in(const std::string& told);

}  // namespace retrograde::jit
