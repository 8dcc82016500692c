// The body of a kernel: the statements of a launch, as the function of one thread. The computations are the same on
// every device; DeviceTarget provides the operations that differ.
#include "codegen/device/kernels.h"
#include "codegen/function_generator.h"
#include "codegen/memory/access.h"
#include "diagnostics/error.h"
#include "ir/build.h"
#include "ir/print.h"
#include "ir/visit.h"

namespace retrograde::codegen {

using namespace ir;

llvm::Function* FunctionGenerator::generate_kernel(KernelUse& kernel) {
  const Launch& launch = *kernel.launch.as<Launch>();
  kernel_ = &kernel;
  std::vector<KernelParameter> parameters;
  for (const KernelUse::Argument& argument : kernel.arguments) {
    llvm::Type* type = argument.is_storage ? b_.getPtrTy() : memory_type(e_, argument.type);
    parameters.push_back(
        {argument.name, argument.is_storage, argument.is_written, type, argument.bytes()});
  }
  llvm::Function* function = device_->declare(e_, kernel.name, parameters, launch);
  const Contraction contraction(e_, !e_.machine.target.has_feature(Target::StrictFloat));
  c_.begin(function);
  const std::vector<Value*> values = device_->arguments(e_, function, parameters);
  for (size_t i = 0; i < values.size(); ++i) {
    const KernelUse::Argument& argument = kernel.arguments[i];
    if (argument.is_storage) {
      c_.frame.storages[argument.name] = {values[i], nullptr, alias_tag(e_, argument.name)};
    } else {
      c_.frame.variables[argument.name] = from_memory(e_, argument.type, values[i]);
    }
  }
  for (int d = 0; d < 3; ++d) {
    c_.frame.variables[thread_index(launch.name, d)] = device_->thread_index(e_, function, d);
    c_.frame.variables[block_index(launch.name, d)] = device_->block_index(e_, function, d);
  }
  statement(launch.body);
  if (c_.frame.error_exit) {
    unsupported("run " + quoted(launch.name) + " on a GPU", "a kernel cannot fail",
                "it contains a check", "Compute the checked values on the host");
  }
  c_.finish(nullptr);
  device_->finish(e_, function, site_metadata());
  return function;
}

unsigned FunctionGenerator::site_metadata() { return e_.context().getMDKindID("retrograde.site"); }

// Marks the instructions that follow as belonging to the statement.
void FunctionGenerator::enter_site(const Stmt& s) {
  if (!kernel_) return;
  if (s.kind() != Kind::Store && s.kind() != Kind::Evaluate && s.kind() != Kind::LetStmt) return;
  std::string text = ir::print(s);
  text = text.substr(0, text.find('\n'));
  constexpr size_t shown = 200;
  if (text.size() > shown) text = text.substr(0, shown) + " ...";
  const auto site = static_cast<uint32_t>(kernel_->sites.size());
  kernel_->sites.push_back(std::move(text));
  auto* number = llvm::ConstantAsMetadata::get(b_.getInt32(site));
  // The builder can only copy metadata from an instruction, so this creates one for a moment.
  llvm::Instruction* marked = new llvm::UnreachableInst(e_.context());
  marked->setMetadata(site_metadata(), llvm::MDNode::get(e_.context(), {number}));
  b_.CollectMetadataToCopy(marked, {site_metadata()});
  marked->deleteValue();
}

void FunctionGenerator::barrier(const Evaluate& s) {
  const auto* call = s.value.as<Call>();
  const int site = static_cast<int>(kernel_->sites.size()) - 1;
  kernel_->suspends = true;
  if (call->is_op(Op::gpu_barrier)) return device_->barrier(e_, c_.frame.function, site);
  device_->warp_barrier(e_, c_.frame.function, site);
}

Storage FunctionGenerator::allocate_in_kernel(const Allocate& s) {
  if (s.memory == MemoryType::GPUShared) {
    const MemoScope scope(c_.frame, false);
    Value* place = device_->shared(e_, c_.frame.function, values_.of(s.offset));
    return {place, nullptr, nullptr};  // other allocations may share its bytes
  }
  const auto elements = as_const_int(s.elements);
  RETROGRADE_ASSERT(elements.has_value(), "a thread's own storage of unknown size: ", s.name);
  llvm::AllocaInst* block =
      c_.entry_alloca(memory_type(e_, s.type), *elements * s.type.lanes(), s.name);
  block->setAlignment(llvm::Align(16));
  return {block, nullptr, alias_tag(e_, s.name), true};
}

}  // namespace retrograde::codegen
