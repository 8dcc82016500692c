// fence_long_blocks -- compile time linear in the length of straight code.
// In:  optimized IR.
// Out: the same instructions; a fence of the own thread, which is no instruction of the machine,
//      after every 64th store of a block with more than 256.
//
// Why: LLVM's machine scheduler compares each access of memory in a block with all others on the
// far side of a store, and walks what it found: 2,000 unrolled statements that read an image took
// 52 s. Over a fence it moves nothing and compares nothing. That far apart little is gained by
// moving, and what is moved stays in a register for longer.
// Not done: blocks of long arithmetic between few stores, whose cost is not in this.
#pragma once

#include <llvm/IR/PassManager.h>

namespace retrograde::codegen {

class FenceLongBlocks : public llvm::PassInfoMixin<FenceLongBlocks> {
 public:
  llvm::PreservedAnalyses run(llvm::Function& function, llvm::FunctionAnalysisManager& analyses);
};

}  // namespace retrograde::codegen
