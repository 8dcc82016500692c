// fuse_products.h -- which products and sums of a kernel are one FMA: decided here once, so that the code
// for a device and that for the executor round alike.
#pragma once

#include <llvm/IR/Function.h>

namespace retrograde::codegen {

// A product that may contract and has one user, a sum that may, becomes one llvm.fma with it; so does every
// llvm.fmuladd. Afterwards nothing may contract: neither LLVM's back ends nor ptxas, which fuses what PTX
// leaves unrounded, have a choice.
void fuse_products(llvm::Function& function);

}  // namespace retrograde::codegen
