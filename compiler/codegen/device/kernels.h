// kernels.h -- the kernels of one lowered function: their code for GPUs and, if requested, for the simulated device,
// and the image that holds both (runtime/gpu/gpu_image.h).
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "codegen/device/device_target.h"
#include "codegen/device/kernel_code.h"
#include "ir/lowered_function.h"

namespace retrograde::codegen {

struct KernelUse {
  // An argument of the kernel: a variable, or the address of storage.
  struct Argument {
    std::string name;
    Type type;  // for storage: any type
    bool is_storage = false, is_written = false;
    int32_t bytes() const { return is_storage ? 8 : type.bytes(); }
  };
  std::string name;  // in the image
  Stmt launch;
  std::vector<Argument> arguments;
  std::vector<std::string>
      sites;  // statements as text, which the simulated device reports; filled while generating
  bool suspends = false;  // whether it has barriers
};

// The symbol of the image.
std::string kernel_image_name(const std::string& function);

class KernelSet {
 public:
  KernelSet(Emitter& host, const ir::LoweredFunction& function) : host_(host), source_(function) {}
  bool empty() const { return kernels_.empty(); }
  KernelUse& add(const Stmt& launch, std::vector<KernelUse::Argument> arguments);
  // The image, and the global variable through which the runtime finds its loaded form.
  llvm::GlobalVariable* image();
  llvm::GlobalVariable* state();
  int64_t image_bytes() const;
  // Fills in the image's contents.
  void finish();
  // The code for GPUs; call it after finish().
  KernelCode described_code() const;

 private:
  std::string ptx();
  void compile_for_executor(std::vector<llvm::Function*>& functions);
  llvm::Constant* described(const KernelUse& kernel, llvm::Function* simt);
  llvm::Constant* text(const std::string& bytes);
  llvm::Constant* table(llvm::Type* element, const std::vector<llvm::Constant*>& entries);
  llvm::GlobalVariable* own_global(llvm::Type* type, const char* what);
  llvm::StructType* image_type() const;

  Emitter& host_;
  const ir::LoweredFunction& source_;
  std::vector<std::unique_ptr<KernelUse>> kernels_;
  std::string code_;
  llvm::GlobalVariable *image_ = nullptr, *state_ = nullptr;
};

}  // namespace retrograde::codegen
