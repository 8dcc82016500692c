// split_addresses -- adds the loop-invariant parts of an address before the loop.
// In:  IR after LICM: loop-invariant values of innermost loops are outside of them.
// Out: the same addresses.
//
//   loop:  x = min(8 i + a, e)                  q = p + (b - c)
//          load p[((x + b) - c) + 1]     =>     loop:  x = min(8 i + a, e)
//                                                      load q[x + 1]
//
// Why: an index sums terms in the order of its dimensions. LLVM's code generator splits only sums that grow by a
// constant step per iteration, and not all of these where there are many. Other sums stay as emitted and cost one to
// four additions per access: indices of vectors that ShiftInwards moves, data-dependent indices, and operands of
// unrolled sums.
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

}  // namespace retrograde::codegen
