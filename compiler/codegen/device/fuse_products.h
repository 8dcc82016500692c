// fuse_products.h -- decides which products and sums of a kernel become FMA. It is decided once, so that GPUs and the
// simulated device round alike.
#pragma once

#include <llvm/IR/Function.h>

namespace retrograde::codegen {

// Fuses a product that has one user with the sum that uses it into llvm.fma, if both may contract. Every llvm.fmuladd
// becomes llvm.fma too. Afterwards nothing may contract, so LLVM's back ends have no choice left, and neither has
// ptxas, which fuses operations that PTX leaves without a rounding mode.
void fuse_products(llvm::Function& function);

}  // namespace retrograde::codegen
