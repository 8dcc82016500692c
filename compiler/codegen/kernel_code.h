// kernel_code.h -- the kernels of a function as text for devices, and what each asks of one.
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
    std::string name;                     // of the launch
    int threads = 0;                      // of a block
    std::optional<int64_t> shared_bytes;  // of a block, where that is no matter of the call
    int64_t local_bytes = 0;              // of a thread: see local_bytes_by_kernel
  };
  std::string ptx;
  int capability = 0;  // 80: of the target that it was made for
  std::vector<Kernel> kernels;
};

// No kernels where the function launches none. Errors as of compile_object.
KernelCode compile_kernels(const ir::LoweredFunction& function, const Options& options);

// The arrays of each kernel of a text that LLVM could not keep in registers: bytes of a thread, by symbol,
// with those of the functions that it calls. Kernels without any are left out.
std::map<std::string, int64_t> local_bytes_by_kernel(std::string_view ptx);

// What to say of them.
std::string local_memory_note(const std::string& kernel, int64_t bytes);

}  // namespace retrograde::codegen
