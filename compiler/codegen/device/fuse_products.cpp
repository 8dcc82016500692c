//   fadd (fmul a, b), c  =>  fma(a, b, c)          fsub (fmul a, b), c  =>  fma(a, b, -c)
//   fadd c, (fmul a, b)  =>  fma(a, b, c)          fsub c, (fmul a, b)  =>  fma(-a, b, c)
//
// In a sum of two products, the first one fuses. LLVM's back ends would decide this only during instruction selection,
// and differently: NVPTX also fuses products with several users, and processors without FMA fuse nothing.
#include "codegen/device/fuse_products.h"

#include <llvm/IR/IRBuilder.h>
#include <llvm/IR/InstIterator.h>
#include <llvm/IR/IntrinsicInst.h>
#include <llvm/IR/Operator.h>

#include <vector>

namespace retrograde::codegen {
namespace {

llvm::BinaryOperator* fusible_product(llvm::Value* value) {
  auto* product = llvm::dyn_cast<llvm::BinaryOperator>(value);
  const bool fuses = product && product->getOpcode() == llvm::Instruction::FMul &&
                     product->hasAllowContract() && product->hasOneUse();
  return fuses ? product : nullptr;
}

llvm::Value* fma(llvm::IRBuilder<>& b, llvm::Value* x, llvm::Value* y, llvm::Value* z) {
  return b.CreateIntrinsic(llvm::Intrinsic::fma, {x->getType()}, {x, y, z});
}

// The replacement of the sum, or null if nothing fuses. `product`: set to the product that fuses.
llvm::Value* fused(llvm::Instruction& sum, llvm::BinaryOperator*& product) {
  const bool is_difference = sum.getOpcode() == llvm::Instruction::FSub;
  if (!is_difference && sum.getOpcode() != llvm::Instruction::FAdd) return nullptr;
  if (!sum.hasAllowContract()) return nullptr;
  llvm::Value *a = sum.getOperand(0), *b = sum.getOperand(1);
  llvm::IRBuilder<> build(&sum);
  if ((product = fusible_product(a))) {
    llvm::Value* rest = is_difference ? build.CreateFNeg(b) : b;
    return fma(build, product->getOperand(0), product->getOperand(1), rest);
  }
  if (!(product = fusible_product(b))) return nullptr;
  llvm::Value* first = product->getOperand(0);
  if (is_difference) first = build.CreateFNeg(first);
  return fma(build, first, product->getOperand(1), a);
}

llvm::Value* expanded_fmuladd(llvm::Instruction& one) {
  const auto* call = llvm::dyn_cast<llvm::IntrinsicInst>(&one);
  if (!call || call->getIntrinsicID() != llvm::Intrinsic::fmuladd) return nullptr;
  llvm::IRBuilder<> build(&one);
  return fma(build, call->getArgOperand(0), call->getArgOperand(1), call->getArgOperand(2));
}

}  // namespace

void fuse_products(llvm::Function& function) {
  for (llvm::Instruction& one : llvm::make_early_inc_range(llvm::instructions(function))) {
    llvm::BinaryOperator* product = nullptr;
    llvm::Value* instead = fused(one, product);
    if (!instead) instead = expanded_fmuladd(one);
    if (!instead) continue;
    one.replaceAllUsesWith(instead);
    one.eraseFromParent();
    if (product) product->eraseFromParent();
  }
  for (llvm::Instruction& one : llvm::instructions(function)) {
    if (llvm::isa<llvm::FPMathOperator>(one)) one.setHasAllowContract(false);
  }
}

}  // namespace retrograde::codegen
