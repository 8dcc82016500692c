#include "codegen/device/kernels.h"

#include <llvm/IR/Verifier.h>

#include "codegen/device/device_math.h"
#include "codegen/device/fuse_products.h"
#include "codegen/device/nested_minima.h"
#include "codegen/device/selectable.h"
#include "codegen/function_generator.h"
#include "codegen/llvm/unit.h"
#include "diagnostics/error.h"
#include "gpu/gpu_image.h"
#include "ir/build.h"

namespace retrograde::codegen {

KernelUse& KernelSet::add(const Stmt& launch, std::vector<KernelUse::Argument> arguments) {
  auto kernel = std::make_unique<KernelUse>();
  // Keep only characters that PTX allows in names.
  kernel->name = source_.name + "_" + std::to_string(kernels_.size());
  for (char& c : kernel->name) {
    if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
  }
  kernel->name = "kernel_" + kernel->name;
  kernel->launch = launch;
  kernel->arguments = std::move(arguments);
  kernels_.push_back(std::move(kernel));
  return *kernels_.back();
}

// ---- the code ----

std::string KernelSet::ptx() {
  const Machine machine = device_machine(host_.machine, Machine::Device::Nvptx);
  Unit unit(machine, source_.name, /*keep_names=*/false);
  Emitter emitter(unit.module(), machine);
  for (const auto& kernel : kernels_) {
    const auto target = make_nvptx_target();
    fuse_products(*FunctionGenerator(emitter, source_, target.get()).generate_kernel(*kernel));
  }
  link_device_math(emitter);
  std::string problem;
  llvm::raw_string_ostream out(problem);
  if (llvm::verifyModule(unit.module(), &out))
    throw InternalError("LLVM rejects a kernel: " + problem, "codegen", text_of(unit.module()));
  unit.optimize();
  const std::string unselectable = find_unselectable(unit.module());
  if (!unselectable.empty()) {
    unsupported("run a part of " + quoted(source_.name) + " on a GPU",
                "kernels contain only operations that LLVM can translate to PTX", unselectable,
                "Compute that part on the host: leave out its gpu_ directives");
  }
  return rewrite_nested_minima(unit.emit_last(llvm::CodeGenFileType::AssemblyFile));
}

void KernelSet::compile_for_executor(std::vector<llvm::Function*>& functions) {
  const Machine machine = device_machine(host_.machine, Machine::Device::Simt);
  Emitter emitter(host_.module, machine);
  for (const auto& kernel : kernels_) {
    kernel->sites.clear();
    const auto target = make_simt_target();
    functions.push_back(FunctionGenerator(emitter, source_, target.get()).generate_kernel(*kernel));
    fuse_products(*functions.back());
  }
  link_device_math(emitter);
}

// ---- the image ----

std::string kernel_image_name(const std::string& function) { return function + ".kernels.image"; }

llvm::GlobalVariable* KernelSet::own_global(llvm::Type* type, const char* what) {
  // Not constant: when a module is compiled in several parts, they share this one.
  return new llvm::GlobalVariable(host_.module, type, false, llvm::GlobalValue::InternalLinkage,
                                  llvm::Constant::getNullValue(type),
                                  source_.name + ".kernels." + what);
}

llvm::StructType* KernelSet::image_type() const {
  llvm::IRBuilder<>& b = host_.b;
  return llvm::StructType::get(host_.context(), {b.getInt64Ty(), b.getInt64Ty(), b.getPtrTy(),
                                                 b.getInt32Ty(), b.getPtrTy()});
}

llvm::GlobalVariable* KernelSet::image() {
  if (image_) return image_;
  image_ = own_global(image_type(), "image");
  image_->setLinkage(llvm::GlobalValue::ExternalLinkage);  // whoever unloads the code looks for it
  return image_;
}
llvm::GlobalVariable* KernelSet::state() {
  if (!state_) state_ = own_global(host_.b.getPtrTy(), "state");
  return state_;
}
int64_t KernelSet::image_bytes() const { return sizeof(retrograde_gpu_image); }

llvm::Constant* KernelSet::text(const std::string& bytes) {
  return host_.b.CreateGlobalString(bytes, source_.name + ".kernels.text");
}

llvm::Constant* KernelSet::table(llvm::Type* element, const std::vector<llvm::Constant*>& entries) {
  auto* type = llvm::ArrayType::get(element, entries.size());
  auto* variable = own_global(type, "table");
  variable->setInitializer(llvm::ConstantArray::get(type, entries));
  return variable;
}

llvm::Constant* KernelSet::described(const KernelUse& kernel, llvm::Function* simt) {
  llvm::IRBuilder<>& b = host_.b;
  std::vector<llvm::Constant*> bytes, sites;
  for (const KernelUse::Argument& argument : kernel.arguments)
    bytes.push_back(b.getInt32(static_cast<uint32_t>(argument.bytes())));
  if (simt) {
    for (const std::string& site : kernel.sites) sites.push_back(text(site));
  }
  const auto count = [&](const auto& list) {
    return b.getInt32(static_cast<uint32_t>(list.size()));
  };
  llvm::Constant* none = llvm::ConstantPointerNull::get(b.getPtrTy());
  return llvm::ConstantStruct::getAnon(
      host_.context(), {text(kernel.name), simt ? static_cast<llvm::Constant*>(simt) : none,
                        b.getInt32(kernel.suspends), count(bytes), table(b.getInt32Ty(), bytes),
                        count(sites), table(b.getPtrTy(), sites)});
}

void KernelSet::finish() {
  if (kernels_.empty()) return;
  llvm::IRBuilder<>& b = host_.b;
  code_ = ptx();
  std::vector<llvm::Function*> simt(kernels_.size(), nullptr);
  if (host_.machine.wants_executor) {
    simt.clear();
    compile_for_executor(simt);
  }
  std::vector<llvm::Constant*> kernels;
  for (size_t i = 0; i < kernels_.size(); ++i) kernels.push_back(described(*kernels_[i], simt[i]));
  const auto count = static_cast<uint32_t>(kernels.size());
  image()->setInitializer(llvm::ConstantStruct::get(
      image_type(), {b.getInt64(RETROGRADE_GPU_IMAGE_MAGIC), b.getInt64(code_.size()), text(code_),
                     b.getInt32(count), table(kernels[0]->getType(), kernels)}));
}

KernelCode KernelSet::described_code() const {
  KernelCode result;
  result.ptx = code_;
  result.capability = host_.machine.target.cuda_capability();
  for (const auto& kernel : kernels_) {
    const auto& launch = *kernel->launch.as<ir::Launch>();
    KernelCode::Kernel one;
    one.symbol = kernel->name;
    one.name = launch.name;
    one.threads = launch.threads[0] * launch.threads[1] * launch.threads[2];
    one.shared_bytes = ir::as_const_int(launch.shared_bytes);
    result.kernels.push_back(std::move(one));
  }
  return result;
}

}  // namespace retrograde::codegen
