// The way through LLVM: generate, optimize, emit.
#include "codegen/codegen.h"

#include <llvm/IR/LegacyPassManager.h>
#include <llvm/IR/Verifier.h>
#include <llvm/Support/raw_ostream.h>
#include <llvm/Target/TargetMachine.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "codegen/function_generator.h"
#include "codegen/optimize.h"
#include "diagnostics/error.h"
#include "diagnostics/large_stack.h"

namespace retrograde::codegen {
namespace {

// Seconds since the last reading.
class Stopwatch {
 public:
  double lap() {
    const auto now = std::chrono::steady_clock::now();
    const double seconds = std::chrono::duration<double>(now - last_).count();
    last_ = now;
    return seconds;
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

void verify(const llvm::Module& module) {
  std::string problem;
  llvm::raw_string_ostream out(problem);
  if (!llvm::verifyModule(module, &out)) return;
  std::string program;
  llvm::raw_string_ostream program_out(program);
  module.print(program_out, nullptr);
  throw InternalError("LLVM rejects the generated code: " + problem, "codegen", program);
}

// One compilation: nothing in it is shared with another.
class Compilation {
 public:
  // Names of values cost time, and only people read them.
  Compilation(const std::vector<ir::LoweredFunction>& functions, const Options& options,
              bool keep_names)
      : machine_(machine_for(options.target, options.tune_for_host)),
        target_machine_(make_target_machine(machine_)),
        module_(functions.empty() ? "retrograde" : functions[0].name, context_) {
    context_.setDiscardValueNames(!keep_names);
    Stopwatch watch;
    module_.setTargetTriple(machine_.triple);
    module_.setDataLayout(target_machine_->createDataLayout());
    Emitter emitter(module_, machine_);
    for (const ir::LoweredFunction& function : functions)
      FunctionGenerator(emitter, function).generate();
    verify(module_);
    times.generate_seconds = watch.lap();
    if (options.optimization_level > 0) optimize(module_, *target_machine_);
    times.optimize_seconds = watch.lap();
  }

  std::string emit(llvm::CodeGenFileType type) {
    Stopwatch watch;
    llvm::SmallVector<char, 0> bytes;
    llvm::raw_svector_ostream out(bytes);
    llvm::legacy::PassManager passes;
    const bool failed = target_machine_->addPassesToEmitFile(passes, out, nullptr, type);
    RETROGRADE_ASSERT(!failed, "LLVM cannot write machine code for ", machine_.triple);
    passes.run(module_);
    times.emit_seconds = watch.lap();
    return std::string(bytes.begin(), bytes.end());
  }

  std::string print() {
    std::string program;
    llvm::raw_string_ostream out(program);
    module_.print(out, nullptr);
    return program;
  }

  std::vector<std::string> externals() const {
    std::vector<std::string> names;
    for (const llvm::Function& function : module_) {
      if (function.isDeclaration() && !function.isIntrinsic())
        names.push_back(function.getName().str());
    }
    std::sort(names.begin(), names.end());
    return names;
  }

  Times times;

 private:
  Machine machine_;
  std::unique_ptr<llvm::TargetMachine> target_machine_;
  llvm::LLVMContext context_;
  llvm::Module module_;
};

}  // namespace

// Compiles on a deep stack and gives what `use` makes of the compilation.
template <typename Use>
static auto compile(const std::vector<ir::LoweredFunction>& functions, const Options& options,
                    bool keep_names, const Use& use) {
  decltype(use(std::declval<Compilation&>())) result;
  run_on_large_stack([&] {
    Compilation compilation(functions, options, keep_names);
    result = use(compilation);
  });
  return result;
}

Module compile_object(const std::vector<ir::LoweredFunction>& functions, const Options& options) {
  return compile(functions, options, false, [](Compilation& compilation) {
    Module result;
    result.externals = compilation.externals();
    const std::string bytes = compilation.emit(llvm::CodeGenFileType::ObjectFile);
    result.object.assign(bytes.begin(), bytes.end());
    result.times = compilation.times;
    return result;
  });
}

Module compile_object(const ir::LoweredFunction& function, const Options& options) {
  return compile_object(std::vector<ir::LoweredFunction>{function}, options);
}

std::string compile_llvm_ir(const ir::LoweredFunction& function, const Options& options) {
  return compile({function}, options, true,
                 [](Compilation& compilation) { return compilation.print(); });
}

std::string compile_assembly(const ir::LoweredFunction& function, const Options& options) {
  return compile({function}, options, true, [](Compilation& compilation) {
    return compilation.emit(llvm::CodeGenFileType::AssemblyFile);
  });
}

}  // namespace retrograde::codegen
