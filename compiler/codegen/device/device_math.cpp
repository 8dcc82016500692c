#include "codegen/device/device_math.h"

#include <llvm/Bitcode/BitcodeReader.h>
#include <llvm/IR/Module.h>
#include <llvm/Linker/Linker.h>

#include <algorithm>

#include "codegen/device/fuse_products.h"
#include "diagnostics/error.h"

// Defined by cmake/RetrogradeDeviceMath.cmake.
extern "C" const char retrograde_device_math_begin[], retrograde_device_math_end[];

namespace retrograde::codegen {

std::string device_math_symbol(const std::string& stem, int bits, int arity) {
  return "_Z" + std::to_string(stem.size()) + stem +
         std::string(static_cast<size_t>(arity), bits == 32 ? 'f' : 'd');
}

static bool calls_any(const llvm::Module& module) {
  return std::any_of(module.begin(), module.end(), [](const llvm::Function& function) {
    return function.isDeclaration() && function.getName().starts_with("_Z");
  });
}

void link_device_math(Emitter& e) {
  llvm::Module& module = e.module;
  if (!calls_any(module)) return;
  const llvm::StringRef bytes(
      retrograde_device_math_begin,
      static_cast<size_t>(retrograde_device_math_end - retrograde_device_math_begin));
  auto library =
      llvm::getLazyBitcodeModule(llvm::MemoryBufferRef(bytes, "libclc"), module.getContext());
  if (!library)
    internal_error("reading the functions of kernels: " + llvm::toString(library.takeError()));
  (*library)->setTargetTriple(module.getTargetTriple());
  (*library)->setDataLayout(module.getDataLayout());
  const bool failed =
      llvm::Linker::linkModules(module, std::move(*library), llvm::Linker::LinkOnlyNeeded,
                                [&](llvm::Module& linked, const llvm::StringSet<>& names) {
                                  for (llvm::GlobalValue& value : linked.global_values()) {
                                    if (value.isDeclaration() || !names.contains(value.getName()))
                                      continue;
                                    value.setLinkage(llvm::GlobalValue::InternalLinkage);
                                    auto* function = llvm::dyn_cast<llvm::Function>(&value);
                                    if (!function) continue;
                                    // The library's attributes name the target that it was built for; these functions
                                    // get the module's.
                                    function->removeFnAttr("target-cpu");
                                    function->removeFnAttr("target-features");
                                    function->removeFnAttr("tune-cpu");
                                    function->removeFnAttr(llvm::Attribute::OptimizeNone);
                                    set_target(e, function);
                                    fuse_products(*function);
                                  }
                                });
  RETROGRADE_ASSERT(!failed, "the functions of kernels do not link");
}

}  // namespace retrograde::codegen
