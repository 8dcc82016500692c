// split_addresses -- what a loop does not change of an address is added before the loop.
// In:  IR after LICM: values that an innermost loop does not change stand outside of it.
// Out: the same addresses.
//
//   loop:  x = min(8 i + a, e)                  q = p + (b - c)
//          load p[((x + b) - c) + 1]     =>     loop:  x = min(8 i + a, e)
//                                                      load q[x + 1]
//
// Why: an index is a sum over dimensions, in their order. LLVM's code generator takes apart sums that
// grow by the same in each iteration. Others stay as they were emitted, with an addition or two for
// each access: those of a vector that ShiftInwards moves, and those that depend on data.
// Source: folklore (reassociation by loop depth), for addresses alone: LLVM's own pass reorders all
// integer arithmetic, and with it the sums and products that are instructions of the machine.
#pragma once

#include <llvm/IR/PassManager.h>

namespace retrograde::codegen {

class SplitAddresses : public llvm::PassInfoMixin<SplitAddresses> {
 public:
  llvm::PreservedAnalyses run(llvm::Function& function, llvm::FunctionAnalysisManager& analyses);
};

}  // namespace retrograde::codegen
