#include "codegen/llvm/split_addresses.h"

#include <llvm/Analysis/LoopInfo.h>
#include <llvm/Analysis/ScalarEvolution.h>
#include <llvm/Analysis/ScalarEvolutionExpressions.h>
#include <llvm/IR/IRBuilder.h>
#include <llvm/IR/Module.h>
#include <llvm/Transforms/Utils/Local.h>

#include <algorithm>
#include <set>
#include <utility>
#include <vector>

namespace retrograde::codegen {
namespace {

struct Term {
  llvm::Value* value;
  bool is_negative;
};

// Indices have one or two terms per dimension. Everything beyond this count is one term.
constexpr size_t most_terms = 24;
// Registers that hold starts of addresses. Counters and bounds take the others.
constexpr size_t most_starts = 12;

// An index as a sum of terms, split by whether the loop changes them.
struct Sum {
  std::vector<Term> fixed, changing;
  uint64_t constant = 0;
};

void add_terms(llvm::Value* value, bool is_negative, const llvm::Loop& loop, Sum& sum) {
  if (const auto* constant = llvm::dyn_cast<llvm::ConstantInt>(value)) {
    const uint64_t number = constant->getZExtValue();
    sum.constant += is_negative ? -number : number;
  } else if (loop.isLoopInvariant(value)) {
    sum.fixed.push_back({value, is_negative});
  } else if (const auto* node = llvm::dyn_cast<llvm::BinaryOperator>(value);
             node && sum.fixed.size() + sum.changing.size() < most_terms &&
             (node->getOpcode() == llvm::Instruction::Add ||
              node->getOpcode() == llvm::Instruction::Sub)) {
    const bool is_difference = node->getOpcode() == llvm::Instruction::Sub;
    add_terms(node->getOperand(0), is_negative, loop, sum);
    add_terms(node->getOperand(1), is_negative != is_difference, loop, sum);
  } else {
    sum.changing.push_back({value, is_negative});
  }
}

llvm::Value* total(llvm::IRBuilder<>& b, const std::vector<Term>& terms) {
  llvm::Value* result = nullptr;
  for (const bool negative : {false, true}) {
    for (const Term& term : terms) {
      if (term.is_negative != negative) continue;
      if (!result) {
        result = negative ? b.CreateNeg(term.value) : term.value;
      } else {
        result = negative ? b.CreateSub(result, term.value) : b.CreateAdd(result, term.value);
      }
    }
  }
  return result;
}

struct Address {
  llvm::Value* start;
  Sum index;  // in elements
};

// LLVM may have added a constant to the start address and hoisted the addition out of the loop. This moves it back into
// the index, so that adjacent accesses share their start.
void move_constants(const llvm::DataLayout& layout, uint64_t element_bytes, Address& address) {
  for (;;) {
    const auto* outer = llvm::dyn_cast<llvm::GetElementPtrInst>(address.start);
    if (!outer || outer->getNumIndices() != 1) return;
    const auto* steps = llvm::dyn_cast<llvm::ConstantInt>(outer->getOperand(1));
    if (!steps) return;
    const uint64_t step = layout.getTypeAllocSize(outer->getSourceElementType());
    const int64_t bytes = steps->getSExtValue() * static_cast<int64_t>(step);
    if (bytes % static_cast<int64_t>(element_bytes) != 0) return;
    address.index.constant += static_cast<uint64_t>(bytes / static_cast<int64_t>(element_bytes));
    address.start = outer->getOperand(0);
  }
}

Address parts_of(const llvm::GetElementPtrInst& access, const llvm::Loop& loop) {
  Address address{access.getOperand(0), {}};
  add_terms(access.getOperand(1), false, loop, address.index);
  const llvm::DataLayout& layout = access.getModule()->getDataLayout();
  move_constants(layout, layout.getTypeAllocSize(access.getSourceElementType()), address);
  return address;
}

using Addresses = std::vector<llvm::GetElementPtrInst*>;

// Finds addresses in the loop whose index sums loop-invariant terms and terms that the loop changes.
Addresses find_sums(const llvm::Loop& loop) {
  Addresses found;
  for (llvm::BasicBlock* block : loop.blocks()) {
    for (llvm::Instruction& one : *block) {
      auto* access = llvm::dyn_cast<llvm::GetElementPtrInst>(&one);
      if (!access || access->getNumIndices() != 1 || !access->getType()->isPointerTy()) continue;
      if (!loop.isLoopInvariant(access->getOperand(0))) continue;
      if (!access->getOperand(1)->getType()->isIntegerTy(64)) continue;
      const Sum sum = parts_of(*access, loop).index;
      if (!sum.fixed.empty() && !sum.changing.empty()) found.push_back(access);
    }
  }
  return found;
}

// The loop-invariant parts of all addresses, each once.
size_t count_starts(const Addresses& addresses, const llvm::Loop& loop) {
  std::set<std::vector<std::pair<llvm::Value*, bool>>> starts;
  for (const llvm::GetElementPtrInst* access : addresses) {
    const Address address = parts_of(*access, loop);
    std::vector<std::pair<llvm::Value*, bool>> start{{address.start, false}};
    for (const Term& term : address.index.fixed) start.emplace_back(term.value, term.is_negative);
    std::sort(start.begin() + 1, start.end());
    starts.insert(std::move(start));
  }
  return starts.size();
}

// LLVM's strength reduction knows how to step through memory, but it may compute long sums in each iteration rather than
// keep their invariant parts. So addresses with a constant step are split, too, if there are registers for all starts.
Addresses find_split(const llvm::Loop& loop, llvm::ScalarEvolution& evolution) {
  Addresses found = find_sums(loop);
  if (count_starts(found, loop) > most_starts) {
    llvm::erase_if(found, [&](llvm::GetElementPtrInst* access) {
      return llvm::isa<llvm::SCEVAddRecExpr>(evolution.getSCEV(access->getOperand(1)));
    });
  }
  return found;
}

void split(llvm::GetElementPtrInst& access, const llvm::Loop& loop) {
  const Address address = parts_of(access, loop);
  llvm::Type* element = access.getSourceElementType();
  llvm::IRBuilder<> before(loop.getLoopPreheader()->getTerminator()), here(&access);
  llvm::Value* start = before.CreateGEP(element, address.start, total(before, address.index.fixed));
  llvm::Value* rest =
      here.CreateAdd(total(here, address.index.changing), here.getInt64(address.index.constant));
  access.replaceAllUsesWith(here.CreateGEP(element, start, rest));
  llvm::RecursivelyDeleteTriviallyDeadInstructions(&access);
}

}  // namespace

llvm::PreservedAnalyses SplitAddresses::run(llvm::Function& function,
                                            llvm::FunctionAnalysisManager& analyses) {
  auto& evolution = analyses.getResult<llvm::ScalarEvolutionAnalysis>(function);
  bool changed = false;
  for (llvm::Loop* loop : analyses.getResult<llvm::LoopAnalysis>(function).getLoopsInPreorder()) {
    if (!loop->isInnermost() || !loop->getLoopPreheader()) continue;
    for (llvm::GetElementPtrInst* address : find_split(*loop, evolution)) {
      split(*address, *loop);
      changed = true;
    }
  }
  if (!changed) return llvm::PreservedAnalyses::all();
  llvm::PreservedAnalyses kept;
  kept.preserveSet<llvm::CFGAnalyses>();
  return kept;
}

}  // namespace retrograde::codegen
