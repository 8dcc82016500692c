#include "codegen/device/selectable.h"

#include <llvm/IR/InstIterator.h>
#include <llvm/IR/Instructions.h>
#include <llvm/IR/IntrinsicInst.h>
#include <llvm/Support/raw_ostream.h>

#include <algorithm>

namespace retrograde::codegen {
namespace {

using llvm::AtomicOrdering;
namespace Intrinsic = llvm::Intrinsic;

std::string printed(const llvm::Instruction& one) {
  std::string text;
  llvm::raw_string_ostream out(text);
  one.print(out);
  return text;
}

bool is_selectable(llvm::Intrinsic::ID id, llvm::StringRef name) {
  if (name.starts_with("llvm.nvvm.")) return true;
  return std::ranges::binary_search(selectable_intrinsics(), id);
}

const char* problem_of_call(const llvm::CallBase& call) {
  const llvm::Function* callee = call.getCalledFunction();
  if (!callee) return "a call of an address";
  if (callee->isIntrinsic())
    return is_selectable(callee->getIntrinsicID(), callee->getName()) ? nullptr : "an intrinsic";
  return callee->isDeclaration() ? "a call of a function of the host" : nullptr;
}

bool is_relaxed(AtomicOrdering order) {
  return order == AtomicOrdering::NotAtomic || order == AtomicOrdering::Unordered ||
         order == AtomicOrdering::Monotonic;
}

const char* problem_of(const llvm::Instruction& one) {
  const llvm::Type* type = one.getType()->getScalarType();
  if (type->isFP128Ty() || type->isX86_FP80Ty() || type->isPPC_FP128Ty())
    return "a float of 16 bytes";
  if (const auto* call = llvm::dyn_cast<llvm::CallBase>(&one)) return problem_of_call(*call);
  switch (one.getOpcode()) {
    case llvm::Instruction::Fence:
      return "a fence";
    case llvm::Instruction::FRem:
      return "a remainder of floats";
    case llvm::Instruction::AtomicRMW:
      return is_relaxed(llvm::cast<llvm::AtomicRMWInst>(one).getOrdering()) ? nullptr
                                                                            : "an order of atomics";
    case llvm::Instruction::AtomicCmpXchg: {
      const auto& exchange = llvm::cast<llvm::AtomicCmpXchgInst>(one);
      const bool ok =
          is_relaxed(exchange.getSuccessOrdering()) && is_relaxed(exchange.getFailureOrdering());
      return ok ? nullptr : "an order of atomics";
    }
    case llvm::Instruction::Load:
      return is_relaxed(llvm::cast<llvm::LoadInst>(one).getOrdering()) ? nullptr
                                                                       : "an order of loads";
    case llvm::Instruction::Store:
      return is_relaxed(llvm::cast<llvm::StoreInst>(one).getOrdering()) ? nullptr
                                                                        : "an order of stores";
    case llvm::Instruction::Invoke:
    case llvm::Instruction::Resume:
    case llvm::Instruction::IndirectBr:
    case llvm::Instruction::VAArg:
      return "an instruction";
    default:
      return nullptr;
  }
}

}  // namespace

const std::vector<llvm::Intrinsic::ID>& selectable_intrinsics() {
  static const std::vector<llvm::Intrinsic::ID> sorted = [] {
    std::vector<llvm::Intrinsic::ID> all = {
        // floats
        Intrinsic::fabs, Intrinsic::sqrt, Intrinsic::floor, Intrinsic::ceil, Intrinsic::trunc,
        Intrinsic::rint, Intrinsic::nearbyint, Intrinsic::round, Intrinsic::roundeven,
        Intrinsic::copysign, Intrinsic::minnum, Intrinsic::maxnum, Intrinsic::minimum,
        Intrinsic::maximum, Intrinsic::fma, Intrinsic::fmuladd, Intrinsic::is_fpclass,
        // integers
        Intrinsic::ctpop, Intrinsic::bitreverse, Intrinsic::bswap, Intrinsic::ctlz, Intrinsic::cttz,
        Intrinsic::abs, Intrinsic::smin, Intrinsic::smax, Intrinsic::umin, Intrinsic::umax,
        Intrinsic::sadd_sat, Intrinsic::uadd_sat, Intrinsic::ssub_sat, Intrinsic::usub_sat,
        Intrinsic::fshl, Intrinsic::fshr, Intrinsic::sadd_with_overflow,
        Intrinsic::uadd_with_overflow, Intrinsic::ssub_with_overflow, Intrinsic::usub_with_overflow,
        Intrinsic::smul_with_overflow, Intrinsic::umul_with_overflow,
        // floats to integers
        Intrinsic::fptosi_sat, Intrinsic::fptoui_sat,
        // vectors
        Intrinsic::vector_reduce_add, Intrinsic::vector_reduce_mul, Intrinsic::vector_reduce_and,
        Intrinsic::vector_reduce_or, Intrinsic::vector_reduce_xor, Intrinsic::vector_reduce_smin,
        Intrinsic::vector_reduce_smax, Intrinsic::vector_reduce_umin, Intrinsic::vector_reduce_umax,
        Intrinsic::vector_reduce_fadd, Intrinsic::vector_reduce_fmul, Intrinsic::vector_reduce_fmin,
        Intrinsic::vector_reduce_fmax, Intrinsic::masked_load, Intrinsic::masked_store,
        Intrinsic::masked_gather, Intrinsic::masked_scatter,
        // no code, or plain loads and stores
        Intrinsic::lifetime_start, Intrinsic::lifetime_end, Intrinsic::assume,
        Intrinsic::experimental_noalias_scope_decl, Intrinsic::memcpy, Intrinsic::memset,
        Intrinsic::memmove};
    std::ranges::sort(all);
    return all;
  }();
  return sorted;
}

std::string find_unselectable(const llvm::Module& module) {
  for (const llvm::GlobalVariable& variable : module.globals()) {
    // Shared memory is provided by the launch.
    const bool is_shared = variable.getAddressSpace() == 3;
    if (variable.isDeclaration() && !is_shared)
      return "a variable of the host: " + variable.getName().str();
  }
  for (const llvm::Function& function : module) {
    for (const llvm::Instruction& one : llvm::instructions(function)) {
      if (const char* problem = problem_of(one)) return std::string(problem) + ":" + printed(one);
    }
  }
  return {};
}

}  // namespace retrograde::codegen
