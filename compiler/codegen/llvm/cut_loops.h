// cut_loops -- splits loops off long functions, so that several threads can compile the pieces (split_module.h).
// In:  a module as generated.
// Out: an equivalent module. No function has much more than a third of its instructions, as long as
//      there are loops worth a call.
//
//   f: for y { produce a; consume a }   =>   f:   for y { f.loop0(...); f.loop1(...) }
//
// Repeatedly picks the loop that gives the two most equal pieces. Excluded are loops
//   1. that do so little per execution that the call and lost hoisting would be noticeable;
//   2. that share values with the rest that may become registers: vectors, small allocations;
//   3. whose values are used afterwards, except error codes.
#pragma once

namespace llvm {
class Module;
}

namespace retrograde::codegen {

// Marks an alloca whose contents are only reloaded by the statement that stores them.
constexpr const char* scratch_mark = "retrograde.scratch";

// Uses lifetime markers to find stack memory that a loop begins anew in each iteration, and removes the markers.
void cut_loops(llvm::Module& module);

}  // namespace retrograde::codegen
