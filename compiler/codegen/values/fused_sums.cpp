// Sums of floats, which fuse with a product to one FMA where the machine has it and the target allows it:
//
//   a * b + c = c + a * b  =>  fmuladd(a, b, c)          a * b - c  =>  fmuladd(a, b, -c)
//                                                        c - a * b  =>  fmuladd(-a, b, c)
//
// The first of two products fuses. The decision is made here, from the expression alone, and LLVM makes none later: it
// would fuse products with one user only. Two copies of an expression in different Funcs would then round differently,
// and adjoints that decide which side of a kink they are on would disagree. Hence a product with several users fuses
// with each of its sums, a product that is the same in all lanes with sums that are not, and a quotient by a power of two
// as the product that LLVM makes of it.
//
// A difference of equal products stays exactly 0, so these do not fuse.
#include <llvm/Analysis/VectorUtils.h>
#include <llvm/IR/Intrinsics.h>
#include <llvm/IR/Operator.h>

#include <optional>
#include <utility>

#include "codegen/emitter.h"

namespace retrograde::codegen {
namespace {

using Product = std::pair<Value*, Value*>;

// 1 / value, if both are powers of two.
llvm::Constant* exact_inverse(Value* value) {
  const auto* constant = llvm::dyn_cast<llvm::Constant>(value);
  if (constant && constant->getType()->isVectorTy()) constant = constant->getSplatValue();
  const auto* number = llvm::dyn_cast_or_null<llvm::ConstantFP>(constant);
  llvm::APFloat inverse(0.0);
  if (!number || !number->getValueAPF().getExactInverse(&inverse)) return nullptr;
  return llvm::ConstantFP::get(value->getType(), inverse);
}

std::optional<Product> product_of(Emitter& e, Value* value) {
  if (const auto* op = llvm::dyn_cast<llvm::BinaryOperator>(value)) {
    if (!llvm::isa<llvm::FPMathOperator>(op) || !op->hasAllowContract()) return std::nullopt;
    Value *a = op->getOperand(0), *b = op->getOperand(1);
    if (op->getOpcode() == llvm::Instruction::FMul) return Product(a, b);
    llvm::Constant* inverse =
        op->getOpcode() == llvm::Instruction::FDiv ? exact_inverse(b) : nullptr;
    return inverse ? std::optional(Product(a, inverse)) : std::nullopt;
  }
  Value* lane = llvm::isa<llvm::ShuffleVectorInst>(value) ? llvm::getSplatValue(value) : nullptr;
  auto product = lane ? product_of(e, lane) : std::nullopt;
  if (!product) return std::nullopt;
  const int lanes = lanes_of(value);
  return Product(splat(e, product->first, lanes), splat(e, product->second, lanes));
}

bool are_equal(const Product& x, const Product& y) {
  return x == y || (x.first == y.second && x.second == y.first);
}

Value* fused(Emitter& e, Value* a, Value* b, Value* c) {
  return e.b.CreateIntrinsic(llvm::Intrinsic::fmuladd, {a->getType()}, {a, b, c});
}

}  // namespace

Value* add_floats(Emitter& e, Value* a, Value* b) {
  if (!e.b.getFastMathFlags().allowContract()) return e.b.CreateFAdd(a, b);
  if (const auto first = product_of(e, a)) return fused(e, first->first, first->second, b);
  if (const auto second = product_of(e, b)) return fused(e, second->first, second->second, a);
  return e.b.CreateFAdd(a, b);
}

Value* subtract_floats(Emitter& e, Value* a, Value* b) {
  if (!e.b.getFastMathFlags().allowContract()) return e.b.CreateFSub(a, b);
  const auto first = product_of(e, a), second = product_of(e, b);
  if (first && second && are_equal(*first, *second)) return e.b.CreateFSub(a, b);
  if (first) return fused(e, first->first, first->second, e.b.CreateFNeg(b));
  if (second) return fused(e, e.b.CreateFNeg(second->first), second->second, a);
  return e.b.CreateFSub(a, b);
}

void keep_sums_as_they_are(llvm::Module& module) {
  for (llvm::Function& function : module) {
    for (llvm::BasicBlock& block : function) {
      for (llvm::Instruction& one : block) {
        if (llvm::isa<llvm::FPMathOperator>(one)) one.setHasAllowContract(false);
      }
    }
  }
}

}  // namespace retrograde::codegen
