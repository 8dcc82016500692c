// unit.h -- a module on its way through LLVM: optimized, then written as bytes or text.
#pragma once

#include <llvm/IR/LLVMContext.h>
#include <llvm/IR/Module.h>
#include <llvm/Target/TargetMachine.h>

#include <memory>
#include <string>
#include <vector>

#include "codegen/codegen.h"
#include "codegen/machine.h"

namespace retrograde::codegen {

std::string bitcode_of(const llvm::Module& module);
std::string text_of(const llvm::Module& module);

// Nothing in it is shared with another: units are worked on by different threads at once.
class Unit {
 public:
  // Names of values cost time, and only people read them.
  Unit(const Machine& machine, const std::string& name, bool keep_names);
  Unit(const Machine& machine, const std::string& name, const std::string& bitcode);
  llvm::Module& module() { return *module_; }
  // To be called when the module is complete: how it is compiled depends on its length, also in parts.
  void note_length();

  void optimize();
  std::string emit(Format format);
  // Emitting changes the module: this must be the last that is asked for, and costs no copy.
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
