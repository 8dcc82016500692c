// cut_long_blocks -- straight code of any length compiles in time linear in its length.
// In:  an optimized function.
// Out: the same function. A block of more than 4,096 instructions became calls of internal
//      functions, each with about 1,024 of them.
//
//   f: a = ...                 f: call f.piece0(frame, ...)      f.piece0: a = ...; frame[0] = a
//      1,024 instructions  =>     call f.piece1(frame, ...)
//      b = a + ...                                               f.piece1: b = frame[0] + ...
//
// Why: LLVM's code generator takes quadratic time for values that live through a long block: its
//      register allocator compares each with all the others, and so do the colouring of stack slots
//      and the two-address pass. The gradient of 2,000 unrolled statements keeps 2,000 values. In a
//      piece nothing lives longer than the piece; what lives longer is in memory, where the register
//      allocator would have spilled it.
// Method: pieces are cut by length. A value that a later piece reads is stored to the frame where it
//      is computed, and loaded once by each piece that reads it. Values from elsewhere are arguments.
//      A product that may fuse into its only sum goes to the piece of the sum, so that the numbers
//      do not change; masks of vectors are computed again, because memory holds them badly.
// The accesses of the frame are volatile: LLVM's instruction selection compares each access that is
//      not with its neighbours to find better chains, which takes longer than all the rest.
// Not done: long code of many short blocks, as unrolled branches have it.
#pragma once

#include <llvm/IR/Function.h>

#include <vector>

namespace retrograde::codegen {

// The functions made, which need no more optimizing.
std::vector<llvm::Function*> cut_long_blocks(llvm::Function& function);

}  // namespace retrograde::codegen
