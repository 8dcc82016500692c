// Kernels for PTX. Parameters are pointers to global memory; they are marked read-only and noalias where that is known,
// so that loads use the read-only path. The block's shared memory is one array.
#include <llvm/IR/IntrinsicsNVPTX.h>
#include <llvm/IR/MDBuilder.h>

#include "codegen/device/device_target.h"

namespace retrograde::codegen {
namespace {

constexpr unsigned global_space = 1, shared_space = 3;
constexpr llvm::StringRef shared_name = "retrograde_shared";

class NvptxTarget : public DeviceTarget {
 public:
  llvm::Function* declare(Emitter& e, const std::string& name,
                          const std::vector<KernelParameter>& parameters,
                          const ir::Launch& launch) override {
    std::vector<llvm::Type*> types;
    for (const KernelParameter& p : parameters)
      types.push_back(p.is_storage ? e.b.getPtrTy(global_space) : p.type);
    auto* type = llvm::FunctionType::get(e.b.getVoidTy(), types, false);
    auto* function =
        llvm::Function::Create(type, llvm::GlobalValue::ExternalLinkage, name, e.module);
    for (unsigned i = 0; i < parameters.size(); ++i) {
      if (!parameters[i].is_storage) continue;
      function->addParamAttr(i, llvm::Attribute::NoAlias);
      if (!parameters[i].is_written) function->addParamAttr(i, llvm::Attribute::ReadOnly);
    }
    annotate(e, function, "kernel", 1);
    constexpr const char* axes[] = {"maxntidx", "maxntidy", "maxntidz"};
    for (size_t d = 0; d < 3; ++d) annotate(e, function, axes[d], launch.threads[d]);
    return function;
  }

  std::vector<Value*> arguments(Emitter&, llvm::Function* function,
                                const std::vector<KernelParameter>&) override {
    std::vector<Value*> values;
    for (llvm::Argument& argument : function->args()) values.push_back(&argument);
    return values;
  }

  Value* thread_index(Emitter& e, llvm::Function*, int dimension) override {
    constexpr llvm::Intrinsic::ID reads[] = {llvm::Intrinsic::nvvm_read_ptx_sreg_tid_x,
                                             llvm::Intrinsic::nvvm_read_ptx_sreg_tid_y,
                                             llvm::Intrinsic::nvvm_read_ptx_sreg_tid_z};
    return e.b.CreateIntrinsic(reads[dimension], {}, {});
  }
  Value* block_index(Emitter& e, llvm::Function*, int dimension) override {
    constexpr llvm::Intrinsic::ID reads[] = {llvm::Intrinsic::nvvm_read_ptx_sreg_ctaid_x,
                                             llvm::Intrinsic::nvvm_read_ptx_sreg_ctaid_y,
                                             llvm::Intrinsic::nvvm_read_ptx_sreg_ctaid_z};
    return e.b.CreateIntrinsic(reads[dimension], {}, {});
  }

  // The launch determines its size.
  Value* shared(Emitter& e, llvm::Function*, Value* offset) override {
    auto* bytes = llvm::ArrayType::get(e.b.getInt8Ty(), 0);
    llvm::GlobalVariable* memory = e.module.getGlobalVariable(shared_name);
    if (!memory) {
      memory = new llvm::GlobalVariable(e.module, bytes, false, llvm::GlobalValue::ExternalLinkage,
                                        nullptr, shared_name, nullptr,
                                        llvm::GlobalValue::NotThreadLocal, shared_space);
      memory->setAlignment(llvm::Align(16));
    }
    return e.b.CreateGEP(e.b.getInt8Ty(), memory, offset);
  }

  void barrier(Emitter& e, llvm::Function*, int) override {
    e.b.CreateIntrinsic(llvm::Intrinsic::nvvm_barrier0, {}, {});
  }
  void warp_barrier(Emitter& e, llvm::Function*, int) override {
    e.b.CreateIntrinsic(llvm::Intrinsic::nvvm_bar_warp_sync, {}, {e.b.getInt32(~0u)});
  }

  void finish(Emitter&, llvm::Function* function, unsigned sites) override {
    for (llvm::BasicBlock& block : *function) {
      for (llvm::Instruction& one : block) one.setMetadata(sites, nullptr);
    }
  }

 private:
  static void annotate(Emitter& e, llvm::Function* function, const char* what, int value) {
    llvm::NamedMDNode* all = e.module.getOrInsertNamedMetadata("nvvm.annotations");
    all->addOperand(llvm::MDNode::get(
        e.context(), {llvm::ValueAsMetadata::get(function), llvm::MDString::get(e.context(), what),
                      llvm::ConstantAsMetadata::get(e.b.getInt32(static_cast<uint32_t>(value)))}));
  }
};

}  // namespace

std::unique_ptr<DeviceTarget> make_nvptx_target() { return std::make_unique<NvptxTarget>(); }

}  // namespace retrograde::codegen
