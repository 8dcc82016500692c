// cut_loops -- loops of long functions become functions of their own, so that several threads can
// compile what was one function (split_module.h).
// In:  a module as generated. Out: one that does the same; no function has much more than a third
//      of it, where loops can be cut off that are worth a call.
//
//   f: for y { produce a; consume a }   =>   f:   for y { f.loop0(...); f.loop1(...) }
//
// Which: the loop that leaves the two most equal pieces, as long as there is one. Not a loop
//   1. that does so little each time that a call and what LLVM hoists out of loops would be felt;
//   2. that shares with the rest what may become registers: vectors, small allocations;
//   3. of which values are used afterwards, error codes apart.
#pragma once

namespace llvm {
class Module;
}

namespace retrograde::codegen {

// On an alloca: what is stored there is loaded again by the same statement.
constexpr const char* scratch_mark = "retrograde.scratch";

// Markers of lifetimes tell which memory on the stack a loop begins with anew each time. They are
// gone afterwards.
void cut_loops(llvm::Module& module);

}  // namespace retrograde::codegen
