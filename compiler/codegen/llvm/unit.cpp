#include "codegen/llvm/unit.h"

#include <llvm/Bitcode/BitcodeReader.h>
#include <llvm/Bitcode/BitcodeWriter.h>
#include <llvm/IR/LegacyPassManager.h>
#include <llvm/Support/raw_ostream.h>
#include <llvm/Transforms/Utils/Cloning.h>

#include <algorithm>
#include <mutex>

#include "codegen/llvm/optimize.h"
#include "codegen/llvm/stopwatch.h"
#include "diagnostics/error.h"

namespace retrograde::codegen {

std::string bitcode_of(const llvm::Module& module) {
  std::string bytes;
  llvm::raw_string_ostream out(bytes);
  llvm::WriteBitcodeToFile(module, out);
  return bytes;
}

std::string text_of(const llvm::Module& module) {
  std::string text;
  llvm::raw_string_ostream out(text);
  module.print(out, nullptr);
  return text;
}

namespace {

// Loop Strength Reduction takes a quarter of the code generator's time for a long module. Without it, Halide's
// applications run in 0.92 to 1.04 times the time, 1.00 on average. LLVM offers only a command-line option to disable
// it, which it reads when it builds its pass list.
constexpr unsigned long_module = 50000;  // instructions before optimization
constexpr const char* is_long = "retrograde.is_long";

bool add_passes(llvm::TargetMachine& machine, llvm::legacy::PassManager& passes,
                llvm::raw_pwrite_stream& out, llvm::CodeGenFileType type, bool reduces_strength) {
  static std::mutex option;
  const std::scoped_lock lock(option);
  set_option("disable-lsr", !reduces_strength);
  const bool failed = machine.addPassesToEmitFile(passes, out, nullptr, type);
  set_option("disable-lsr", false);
  return !failed;
}

}  // namespace

Unit::Unit(const Machine& machine, const std::string& name, bool keep_names)
    : target_machine_(make_target_machine(machine)),
      module_(std::make_unique<llvm::Module>(name, context_)) {
  context_.setDiscardValueNames(!keep_names);
  module_->setTargetTriple(machine.triple);
  module_->setDataLayout(target_machine_->createDataLayout());
}

Unit::Unit(const Machine& machine, const std::string& name, const std::string& bitcode)
    : target_machine_(make_target_machine(machine)) {
  auto parsed = llvm::parseBitcodeFile(llvm::MemoryBufferRef(bitcode, name), context_);
  if (!parsed)
    internal_error("reading a part of " + name + ": " + llvm::toString(parsed.takeError()));
  module_ = std::move(*parsed);
}

void Unit::note_length() {
  if (module_->getInstructionCount() > long_module)
    module_->addModuleFlag(llvm::Module::Warning, is_long, 1);
}

void Unit::optimize() {
  Stopwatch watch;
  codegen::optimize(*module_, *target_machine_);
  times.optimize_seconds = watch.lap();
}

std::string Unit::emit(llvm::CodeGenFileType type, llvm::Module& source) {
  Stopwatch watch;
  llvm::SmallVector<char, 0> bytes;
  llvm::raw_svector_ostream out(bytes);
  llvm::legacy::PassManager passes;
  const bool reduces_strength = source.getModuleFlag(is_long) == nullptr;
  const bool added = add_passes(*target_machine_, passes, out, type, reduces_strength);
  RETROGRADE_ASSERT(added, "LLVM cannot write machine code for ", source.getTargetTriple());
  passes.run(source);
  times.emit_seconds = watch.lap();
  return std::string(bytes.begin(), bytes.end());
}

std::string Unit::emit(Format format) {
  switch (format) {
    case Format::LlvmIr:
      return text_of(*module_);
    case Format::Bitcode:
      return bitcode_of(*module_);
    default:
      target_machine_->Options.MCOptions.AsmVerbose = true;  // comments name blocks and spills
      return emit(llvm::CodeGenFileType::AssemblyFile, *llvm::CloneModule(*module_));
  }
}

std::vector<std::string> Unit::externals() const {
  std::vector<std::string> names;
  for (const llvm::Function& function : *module_) {
    if (function.isDeclaration() && !function.isIntrinsic())
      names.push_back(function.getName().str());
  }
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace retrograde::codegen
