#include "codegen/llvm/fence_long_blocks.h"

#include <llvm/IR/IRBuilder.h>

#include <vector>

namespace retrograde::codegen {

constexpr size_t long_block = 256, stores_between = 64;

static std::vector<llvm::Instruction*> stores_in(llvm::BasicBlock& block) {
  std::vector<llvm::Instruction*> stores;
  for (llvm::Instruction& one : block) {
    if (one.mayWriteToMemory() && !one.isTerminator()) stores.push_back(&one);
  }
  return stores;
}

llvm::PreservedAnalyses FenceLongBlocks::run(llvm::Function& function,
                                             llvm::FunctionAnalysisManager&) {
  bool changed = false;
  for (llvm::BasicBlock& block : function) {
    const std::vector<llvm::Instruction*> stores = stores_in(block);
    if (stores.size() <= long_block) continue;
    for (size_t i = stores_between; i < stores.size(); i += stores_between) {
      llvm::IRBuilder<> builder(stores[i]);
      builder.CreateFence(llvm::AtomicOrdering::SequentiallyConsistent,
                          llvm::SyncScope::SingleThread);
    }
    changed = true;
  }
  return changed ? llvm::PreservedAnalyses::none() : llvm::PreservedAnalyses::all();
}

}  // namespace retrograde::codegen
