// The way through LLVM: generate, optimize, emit.
#include "codegen/codegen.h"

#include <llvm/Bitcode/BitcodeWriter.h>
#include <llvm/IR/LegacyPassManager.h>
#include <llvm/IR/Verifier.h>
#include <llvm/Support/raw_ostream.h>
#include <llvm/Target/TargetMachine.h>
#include <llvm/Transforms/Utils/Cloning.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "codegen/function_generator.h"
#include "codegen/make_exports.h"
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
  Compilation(const Program& program, const Options& options, bool keep_names)
      : machine_(machine_for(options.target, options.tune_for_host)),
        target_machine_(make_target_machine(machine_)),
        module_(program.functions.empty() ? "retrograde" : program.functions[0].name, context_) {
    context_.setDiscardValueNames(!keep_names);
    Stopwatch watch;
    module_.setTargetTriple(machine_.triple);
    module_.setDataLayout(target_machine_->createDataLayout());
    Emitter emitter(module_, machine_);
    for (const ir::LoweredFunction& function : program.functions)
      FunctionGenerator(emitter, function).generate();
    add_exports(emitter, program);
    verify(module_);
    times.generate_seconds = watch.lap();
    if (options.optimization_level > 0) optimize(module_, *target_machine_);
    times.optimize_seconds = watch.lap();
  }

  // Emitting changes the module: what comes later is emitted from `source`, a copy.
  std::string emit(llvm::CodeGenFileType type, llvm::Module& source) {
    Stopwatch watch;
    llvm::SmallVector<char, 0> bytes;
    llvm::raw_svector_ostream out(bytes);
    llvm::legacy::PassManager passes;
    const bool failed = target_machine_->addPassesToEmitFile(passes, out, nullptr, type);
    RETROGRADE_ASSERT(!failed, "LLVM cannot write machine code for ", machine_.triple);
    passes.run(source);
    times.emit_seconds = watch.lap();
    return std::string(bytes.begin(), bytes.end());
  }

  std::string emit(llvm::CodeGenFileType type) { return emit(type, module_); }

  std::string emit(Format format) {
    switch (format) {
      case Format::LlvmIr:
        return print();
      case Format::Bitcode:
        return bitcode();
      default:
        target_machine_->Options.MCOptions.AsmVerbose = true;  // comments name blocks and spills
        return emit(format == Format::Object ? llvm::CodeGenFileType::ObjectFile
                                             : llvm::CodeGenFileType::AssemblyFile,
                    *llvm::CloneModule(module_));
    }
  }

  std::string bitcode() {
    std::string bytes;
    llvm::raw_string_ostream out(bytes);
    llvm::WriteBitcodeToFile(module_, out);
    return bytes;
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
  // The function itself is called through its export; its argv form is not needed.
  void add_exports(Emitter& emitter, const Program& program) {
    for (const Export& e : program.exports) {
      const std::string& name = program.functions[e.function].name;
      module_.getFunction(name + "_argv")->eraseFromParent();
      make_export(emitter, e, module_.getFunction(name));
    }
    for (const Dispatch& dispatch : program.dispatches) make_dispatch(emitter, dispatch);
  }

  Machine machine_;
  std::unique_ptr<llvm::TargetMachine> target_machine_;
  llvm::LLVMContext context_;
  llvm::Module module_;
};

}  // namespace

// Compiles on a deep stack and gives what `use` makes of the compilation.
template <typename Use>
static auto compile(const Program& program, const Options& options, bool keep_names,
                    const Use& use) {
  decltype(use(std::declval<Compilation&>())) result;
  run_on_large_stack([&] {
    Compilation compilation(program, options, keep_names);
    result = use(compilation);
  });
  return result;
}

Module compile_object(const std::vector<ir::LoweredFunction>& functions, const Options& options) {
  return compile({functions, {}, {}}, options, false, [](Compilation& compilation) {
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

std::map<Format, std::string> compile_program(const Program& program, const Options& options,
                                              const std::vector<Format>& formats) {
  bool keep_names = false;  // an object needs none
  for (Format format : formats) keep_names = keep_names || format != Format::Object;
  return compile(program, options, keep_names, [&](Compilation& compilation) {
    std::map<Format, std::string> result;
    for (Format format : formats) result[format] = compilation.emit(format);
    return result;
  });
}

std::string compile_llvm_ir(const ir::LoweredFunction& function, const Options& options) {
  return compile({{function}, {}, {}}, options, true,
                 [](Compilation& compilation) { return compilation.print(); });
}

std::string compile_assembly(const ir::LoweredFunction& function, const Options& options) {
  return compile({{function}, {}, {}}, options, true, [](Compilation& compilation) {
    return compilation.emit(llvm::CodeGenFileType::AssemblyFile);
  });
}

}  // namespace retrograde::codegen
