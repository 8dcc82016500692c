// Optimizes generated code; optimize.cpp explains the choice of passes.
#pragma once

namespace llvm {
class Module;
class TargetMachine;
}  // namespace llvm

namespace retrograde::codegen {
void optimize(llvm::Module& module, llvm::TargetMachine& machine);
}
