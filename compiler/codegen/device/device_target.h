// device_target.h -- the operations of a kernel that depend on the device. There are two implementations: GPUs that run
// PTX (nvptx_target.cpp), and the simulated device, which runs kernels on this machine (simt_target.cpp). All other
// kernel code is the same for both.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "codegen/emitter.h"
#include "ir/expr.h"

namespace retrograde::codegen {

// A parameter of a kernel: a variable, or the address of memory allocated outside it.
struct KernelParameter {
  std::string name;
  bool is_storage = false;
  bool is_written = false;  // storage alone
  llvm::Type* type = nullptr;
  int64_t bytes = 0;
};

class DeviceTarget {
 public:
  virtual ~DeviceTarget() = default;
  // Declares the function. The insertion point does not move.
  virtual llvm::Function* declare(Emitter& e, const std::string& name,
                                  const std::vector<KernelParameter>& parameters,
                                  const ir::Launch& launch) = 0;
  // The parameters' values, in order; called at the start of the function.
  virtual std::vector<Value*> arguments(Emitter& e, llvm::Function* function,
                                        const std::vector<KernelParameter>& parameters) = 0;
  virtual Value* thread_index(Emitter& e, llvm::Function* function, int dimension) = 0;
  virtual Value* block_index(Emitter& e, llvm::Function* function, int dimension) = 0;
  // The block's shared memory, starting at `offset` (int32, bytes).
  virtual Value* shared(Emitter& e, llvm::Function* function, Value* offset) = 0;
  virtual void barrier(Emitter& e, llvm::Function* function, int site) = 0;
  virtual void warp_barrier(Emitter& e, llvm::Function* function, int site) = 0;
  // Called when the code is complete. `sites`: the metadata kind that names each instruction's statement.
  virtual void finish(Emitter& e, llvm::Function* function, unsigned sites) = 0;
};

std::unique_ptr<DeviceTarget> make_nvptx_target();
std::unique_ptr<DeviceTarget> make_simt_target();

}  // namespace retrograde::codegen
