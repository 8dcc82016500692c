// cut_long_blocks -- makes compile time linear in the length of straight-line code.
// In:  an optimized function.
// Out: the same function. Each block of more than 4,096 instructions is replaced by calls of internal
//      functions, each with about 1,024 of them.
//
//   f: a = ...                 f: call f.piece0(frame, ...)      f.piece0: a = ...; frame[0] = a
//      1,024 instructions  =>     call f.piece1(frame, ...)
//      b = a + ...                                               f.piece1: b = frame[0] + ...
//
// Why: LLVM's code generator takes quadratic time for values that live through a long block: its
//      register allocator compares each with all the others, and so do stack-slot colouring and the
//      two-address pass. The gradient of 2,000 unrolled statements keeps 2,000 such values. Within a
//      piece no value outlives the piece; longer-lived values are in memory, where the register
//      allocator would have spilled them anyway.
// Method: pieces have equal length. A value that a later piece reads is stored to the frame where it
//      is computed, and loaded once by each piece that reads it. Values from other blocks are
//      arguments. A product that may fuse into its only sum moves to the piece of the sum, so that
//      results do not change. Vector masks are recomputed, because memory holds them badly.
//      Accesses to the frame are volatile: instruction selection compares every access that is not
//      volatile with its neighbours to find better chains, which takes longer than everything else.
// Not done: long code that consists of many short blocks, as unrolled branches give.
#pragma once

#include <llvm/IR/Function.h>

#include <vector>

namespace retrograde::codegen {

// Returns the new functions, which need no further optimization.
std::vector<llvm::Function*> cut_long_blocks(llvm::Function& function);

}  // namespace retrograde::codegen
