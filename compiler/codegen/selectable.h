// selectable.h -- what LLVM's back end for NVPTX has instructions for. What it lacks ends the process
// while instructions are selected, so modules are looked at before.
#pragma once

#include <llvm/IR/Intrinsics.h>
#include <llvm/IR/Module.h>

#include <string>
#include <vector>

namespace retrograde::codegen {

// Intrinsics of any types that kernels use; test/unit/selectable_test.cpp compiles each of them.
const std::vector<llvm::Intrinsic::ID>& selectable_intrinsics();

// The first thing in `module` that NVPTX does not select, or selects and gets wrong: fences, calls of what
// the module has no code for, remainders of floats (quotients beyond 2^24 are rounded), atomics that are more
// than relaxed (they become relaxed), floats of 16 bytes, variables of the host. Empty: there is none.
std::string find_unselectable(const llvm::Module& module);

}  // namespace retrograde::codegen
