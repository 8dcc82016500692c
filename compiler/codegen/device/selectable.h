// selectable.h -- lists what LLVM's NVPTX back end can select. Unsupported operations would abort the process during
// instruction selection, so modules are checked first.
#pragma once

#include <llvm/IR/Intrinsics.h>
#include <llvm/IR/Module.h>

#include <string>
#include <vector>

namespace retrograde::codegen {

// Intrinsics that kernels may use, with any types; test/unit/codegen/selectable_test.cpp compiles each of them.
const std::vector<llvm::Intrinsic::ID>& selectable_intrinsics();

// Describes the first thing in `module` that NVPTX cannot select or selects wrongly; empty if there is none. These are
// fences, calls of functions that the module does not define, float remainders (wrong for quotients beyond 2^24),
// atomics stronger than relaxed (they become relaxed), 16-byte floats, and the host's variables.
std::string find_unselectable(const llvm::Module& module);

}  // namespace retrograde::codegen
