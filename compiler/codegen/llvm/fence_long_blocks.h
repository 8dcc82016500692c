// fence_long_blocks -- makes compile time linear in the length of straight-line code.
// In:  optimized IR.
// Out: the same instructions, plus a single-thread fence after every 64th store of each block with more
//      than 256 stores. Such a fence emits no machine instruction.
//
// Why: LLVM's machine scheduler compares each memory access in a block with all accesses across a store, and walks the
// edges that it finds: 2,000 unrolled statements that read an image took 52 s. It neither moves nor compares accesses
// across a fence. Moving accesses that far gains little and keeps values in registers for longer.
// Not done: blocks of long arithmetic between few stores, whose cost lies elsewhere.
#pragma once

#include <llvm/IR/PassManager.h>

namespace retrograde::codegen {

class FenceLongBlocks : public llvm::PassInfoMixin<FenceLongBlocks> {
 public:
  llvm::PreservedAnalyses run(llvm::Function& function, llvm::FunctionAnalysisManager& analyses);
};

}  // namespace retrograde::codegen
