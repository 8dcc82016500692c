// device_target.h -- what a kernel's code asks of the device that it runs on. Two implementations: a
// GPU that understands PTX (nvptx_target.cpp), and this machine under the executor of kernels
// (simt_target.cpp), whose code is the same but for these.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "codegen/emitter.h"
#include "ir/expr.h"

namespace retrograde::codegen {

// What a kernel is given: variables and the first elements of memory of its surroundings.
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
  // The function and its parameters' values, in order. The insertion point is not moved.
  virtual llvm::Function* declare(Emitter& e, const std::string& name,
                                  const std::vector<KernelParameter>& parameters,
                                  const ir::Launch& launch) = 0;
  // At the beginning of the function.
  virtual std::vector<Value*> arguments(Emitter& e, llvm::Function* function,
                                        const std::vector<KernelParameter>& parameters) = 0;
  virtual Value* thread_index(Emitter& e, llvm::Function* function, int dimension) = 0;
  virtual Value* block_index(Emitter& e, llvm::Function* function, int dimension) = 0;
  // The block's memory from `offset` (int32, bytes) on.
  virtual Value* shared(Emitter& e, llvm::Function* function, Value* offset) = 0;
  virtual void barrier(Emitter& e, llvm::Function* function, int site) = 0;
  virtual void warp_barrier(Emitter& e, llvm::Function* function, int site) = 0;
  // When the code is there. `sites`: the metadata that names each instruction's statement.
  virtual void finish(Emitter& e, llvm::Function* function, unsigned sites) = 0;
};

std::unique_ptr<DeviceTarget> make_nvptx_target();
std::unique_ptr<DeviceTarget> make_simt_target();

}  // namespace retrograde::codegen
