// kernel_code.h -- the PTX of a function's kernels, with the resources that each one needs.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "codegen/codegen.h"

namespace retrograde::codegen {

struct KernelCode {
  struct Kernel {
    std::string symbol;                   // in the PTX
    std::string name;                     // name of the launch
    int threads = 0;                      // per block
    std::optional<int64_t> shared_bytes;  // per block; none if it depends on the call's arguments
    int64_t local_bytes = 0;              // per thread: see local_bytes_by_kernel
  };
  std::string ptx;
  int capability = 0;  // 80 means 8.0: the compute capability of the target
  std::vector<Kernel> kernels;
};

// Empty if the function launches no kernels. Throws the errors of compile_object.
KernelCode compile_kernels(const ir::LoweredFunction& function, const Options& options);

// For each kernel in a PTX text, the bytes per thread of the arrays that LLVM could not keep in registers, by symbol.
// They include those of the functions that it calls. Kernels without such arrays are left out.
std::map<std::string, int64_t> local_bytes_by_kernel(std::string_view ptx);

// The performance note about them.
std::string local_memory_note(const std::string& kernel, int64_t bytes);

}  // namespace retrograde::codegen
