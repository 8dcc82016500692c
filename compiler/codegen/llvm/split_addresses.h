// split_addresses -- adds the loop-invariant parts of an address before the loop.
// In:  IR after LICM: loop-invariant values of innermost loops are outside of them.
// Out: the same addresses. Those of a block that are equal are computed once, in whatever order their terms were added.
//
//   loop:  x = min(8 i + a, e)                  q = p + (b - c)
//          load p[((x + b) - c) + 1]     =>     loop:  x = min(8 i + a, e)
//                                                      load q[x + 1]
//
// Why: an index sums terms in the order of its dimensions. LLVM's code generator splits only sums that grow by a
// constant step per iteration. Other sums stay as emitted and cost one or two additions per access: indices of vectors
// that ShiftInwards moves, and data-dependent indices.
// Source: folklore (reassociation by loop depth), restricted to addresses. LLVM's own pass reorders all integer
// arithmetic and so breaks sums and products that match machine instructions.
#pragma once

#pragma once

#include <llvm/IR/PassManager.h>

namespace retrograde::codegen {

class SplitAddresses : public llvm::PassInfoMixin<SplitAddresses> {
 public:
  llvm::PreservedAnalyses run(llvm::Function& function, llvm::FunctionAnalysisManager& analyses);
};

// Gives each row that a loop walks along a pointer to its start, in a register, if there are many rows. LLVM's code
// generator would compute some of their addresses in each iteration, and run out of registers for vectors on the way.
class HoldRowStarts : public llvm::PassInfoMixin<HoldRowStarts> {
 public:
  llvm::PreservedAnalyses run(llvm::Function& function, llvm::FunctionAnalysisManager& analyses);
};

}  // namespace retrograde::codegen
