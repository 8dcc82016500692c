// fuse_products.h -- decides which products and sums of a kernel become FMA. It is decided once, so that GPUs and the
// simulated device round alike.
#pragma once

#include <llvm/IR/Function.h>

namespace retrograde::codegen {

// Every llvm.fmuladd becomes llvm.fma: those that values/fused_sums.cpp made, and those of libclc's functions. What may
// still contract there is a product with one user, which fuses with the sum that uses it. Afterwards nothing may contract, so LLVM's back ends have no choice left, and neither has
// ptxas, which fuses operations that PTX leaves without a rounding mode.
void fuse_products(llvm::Function& function);

}  // namespace retrograde::codegen
