// unit.h -- a module on its way through LLVM: it is optimized, then emitted as bytes or text.
#pragma once

#include <llvm/IR/LLVMContext.h>
#include <llvm/IR/Module.h>
#include <llvm/Target/TargetMachine.h>

#include <memory>
#include <string>
#include <vector>

#include "codegen/codegen.h"
#include "codegen/llvm/machine.h"

namespace retrograde::codegen {

std::string bitcode_of(const llvm::Module& module);
std::string text_of(const llvm::Module& module);

// Units share no state, so different threads can work on different units.
class Unit {
 public:
  // Keeping value names costs time; they only help human readers of the IR.
  Unit(const Machine& machine, const std::string& name, bool keep_names);
  Unit(const Machine& machine, const std::string& name, const std::string& bitcode);
  llvm::Module& module() { return *module_; }
  // Call this when the module is complete, before it is split: its length decides how all its parts are compiled.
  void note_length();

  void optimize();
  std::string emit(Format format);
  // Emitting changes the module. This saves the copy, and must be the last call.
  std::string emit_last(llvm::CodeGenFileType type) { return emit(type, *module_); }
  std::vector<std::string> externals() const;  // sorted

  Times times;

 private:
  std::string emit(llvm::CodeGenFileType type, llvm::Module& source);

  std::unique_ptr<llvm::TargetMachine> target_machine_;
  llvm::LLVMContext context_;
  std::unique_ptr<llvm::Module> module_;
};

}  // namespace retrograde::codegen
