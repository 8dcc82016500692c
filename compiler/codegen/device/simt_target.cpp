// Kernels for the simulated device (runtime/gpu/gpu_image.h). A kernel is a function that takes a thread and the memory
// of its arguments. Barriers are calls, and a call before each access reports it.
#include <llvm/Analysis/ValueTracking.h>
#include <llvm/IR/IntrinsicInst.h>

#include <cstddef>
#include <set>

#include "codegen/device/device_target.h"
#include "gpu/gpu_image.h"

namespace retrograde::codegen {
namespace {

class SimtTarget : public DeviceTarget {
 public:
  llvm::Function* declare(Emitter& e, const std::string& name, const std::vector<KernelParameter>&,
                          const ir::Launch&) override {
    auto* type = llvm::FunctionType::get(e.b.getVoidTy(), {e.b.getPtrTy(), e.b.getPtrTy()}, false);
    return llvm::Function::Create(type, llvm::GlobalValue::InternalLinkage, name + ".simt",
                                  e.module);
  }

  // The arguments are packed in order, each at its natural alignment.
  std::vector<Value*> arguments(Emitter& e, llvm::Function* function,
                                const std::vector<KernelParameter>& parameters) override {
    std::vector<Value*> values;
    int64_t offset = 0;
    for (const KernelParameter& p : parameters) {
      offset = (offset + p.bytes - 1) / p.bytes * p.bytes;
      Value* at = e.b.CreateConstGEP1_64(e.b.getInt8Ty(), function->getArg(1),
                                         static_cast<uint64_t>(offset));
      auto* load = e.b.CreateLoad(p.is_storage ? e.b.getPtrTy() : p.type, at);
      own_.insert(load);
      values.push_back(load);
      offset += p.bytes;
    }
    return values;
  }

  Value* thread_index(Emitter& e, llvm::Function* function, int dimension) override {
    return field(e, function, offsetof(retrograde_simt_thread, thread) + 4 * dimension,
                 e.b.getInt32Ty());
  }
  Value* block_index(Emitter& e, llvm::Function* function, int dimension) override {
    return field(e, function, offsetof(retrograde_simt_thread, block) + 4 * dimension,
                 e.b.getInt32Ty());
  }
  Value* shared(Emitter& e, llvm::Function* function, Value* offset) override {
    Value* memory = field(e, function, offsetof(retrograde_simt_thread, shared), e.b.getPtrTy());
    shared_.insert(memory);
    return e.b.CreateGEP(e.b.getInt8Ty(), memory, offset);
  }

  void barrier(Emitter& e, llvm::Function* function, int site) override {
    call(e, function, offsetof(retrograde_simt_calls, barrier), {number(e, site)});
  }
  void warp_barrier(Emitter& e, llvm::Function* function, int site) override {
    call(e, function, offsetof(retrograde_simt_calls, warp_barrier), {number(e, site)});
  }

  void finish(Emitter& e, llvm::Function* function, unsigned sites) override {
    std::vector<llvm::Instruction*> accesses;
    for (llvm::BasicBlock& block : *function) {
      for (llvm::Instruction& one : block) {
        if (pointer_of(one) && !own_.count(&one)) accesses.push_back(&one);
      }
    }
    for (llvm::Instruction* one : accesses) tell(e, function, *one, sites);
    for (llvm::BasicBlock& block : *function) {
      for (llvm::Instruction& one : block) one.setMetadata(sites, nullptr);
    }
  }

 private:
  static Value* number(Emitter& e, int value) { return e.b.getInt32(static_cast<uint32_t>(value)); }

  Value* field(Emitter& e, llvm::Function* function, size_t offset, llvm::Type* type) {
    auto* load =
        e.b.CreateLoad(type, e.b.CreateConstGEP1_64(e.b.getInt8Ty(), function->getArg(0), offset));
    load->setMetadata(llvm::LLVMContext::MD_invariant_load, llvm::MDNode::get(e.context(), {}));
    own_.insert(load);
    return load;
  }

  void call(Emitter& e, llvm::Function* function, size_t offset, std::vector<Value*> args) {
    Value* calls = field(e, function, offsetof(retrograde_simt_thread, calls), e.b.getPtrTy());
    auto* target =
        e.b.CreateLoad(e.b.getPtrTy(), e.b.CreateConstGEP1_64(e.b.getInt8Ty(), calls, offset));
    target->setMetadata(llvm::LLVMContext::MD_invariant_load, llvm::MDNode::get(e.context(), {}));
    own_.insert(target);
    args.insert(args.begin(), function->getArg(0));
    std::vector<llvm::Type*> types;
    for (Value* arg : args) types.push_back(arg->getType());
    e.b.CreateCall(llvm::FunctionType::get(e.b.getVoidTy(), types, false), target, args);
  }

  static Value* pointer_of(llvm::Instruction& one) {
    if (auto* load = llvm::dyn_cast<llvm::LoadInst>(&one)) return load->getPointerOperand();
    if (auto* store = llvm::dyn_cast<llvm::StoreInst>(&one)) return store->getPointerOperand();
    if (auto* update = llvm::dyn_cast<llvm::AtomicRMWInst>(&one))
      return update->getPointerOperand();
    if (auto* update = llvm::dyn_cast<llvm::AtomicCmpXchgInst>(&one))
      return update->getPointerOperand();
    return nullptr;
  }

  void tell(Emitter& e, llvm::Function* function, llvm::Instruction& one, unsigned sites) {
    Value* pointer = pointer_of(one);
    const Value* memory = llvm::getUnderlyingObject(pointer, 0);
    if (llvm::isa<llvm::AllocaInst>(memory)) return;  // private to the thread
    const llvm::MDNode* site = one.getMetadata(sites);
    const auto number_of_site = [&] {
      return site ? static_cast<int>(llvm::mdconst::extract<llvm::ConstantInt>(site->getOperand(0))
                                         ->getZExtValue())
                  : -1;
    };
    const auto* store = llvm::dyn_cast<llvm::StoreInst>(&one);
    // The first load of a compare-and-swap loop is atomic, too.
    const bool is_load = llvm::isa<llvm::LoadInst>(one) && !one.isAtomic();
    llvm::Type* type = store ? store->getValueOperand()->getType() : one.getType();
    if (const auto* update = llvm::dyn_cast<llvm::AtomicCmpXchgInst>(&one))
      type = update->getNewValOperand()->getType();
    const auto bytes = e.module.getDataLayout().getTypeStoreSize(type).getFixedValue();
    const llvm::IRBuilderBase::InsertPointGuard guard(e.b);
    e.b.SetInsertPoint(&one);
    call(e, function, offsetof(retrograde_simt_calls, access),
         {pointer, number(e, static_cast<int>(bytes)),
          number(e, is_load ? retrograde_simt_load
                    : store ? retrograde_simt_store
                            : retrograde_simt_atomic),
          number(e, shared_.count(memory) ? retrograde_simt_shared : retrograde_simt_global),
          number(e, number_of_site())});
  }

  std::set<const Value*> own_, shared_;  // loads of values that the simulated device passes in
};

}  // namespace

std::unique_ptr<DeviceTarget> make_simt_target() { return std::make_unique<SimtTarget>(); }

}  // namespace retrograde::codegen
