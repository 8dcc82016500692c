#include "codegen/llvm/split_addresses.h"

#include <llvm/Analysis/LoopInfo.h>
#include <llvm/Analysis/ScalarEvolution.h>
#include <llvm/Analysis/ScalarEvolutionExpressions.h>
#include <llvm/IR/IRBuilder.h>
#include <llvm/IR/Module.h>
#include <llvm/Transforms/Utils/Local.h>

#include <map>
#include <tuple>
#include <vector>

namespace retrograde::codegen {
namespace {

struct Term {
  llvm::Value* value;
  bool is_negative;
};

// Indices have one or two terms per dimension. Everything beyond this count is one term.
constexpr size_t most_terms = 24;

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

// Finds addresses in the loop whose index sums loop-invariant terms and terms that the loop changes.
std::vector<llvm::GetElementPtrInst*> find_sums(const llvm::Loop& loop) {
  std::vector<llvm::GetElementPtrInst*> found;
  for (llvm::BasicBlock* block : loop.blocks()) {
    for (llvm::Instruction& one : *block) {
      auto* access = llvm::dyn_cast<llvm::GetElementPtrInst>(&one);
      if (!access || access->getNumIndices() != 1 || !access->getType()->isPointerTy()) continue;
      if (!loop.isLoopInvariant(access->getOperand(0))) continue;
      llvm::Value* index = access->getOperand(1);
      if (!index->getType()->isIntegerTy(64)) continue;
      const Sum sum = parts_of(*access, loop).index;
      if (!sum.fixed.empty() && !sum.changing.empty()) found.push_back(access);
    }
  }
  return found;
}

// `held`: the start, if it is one that nobody takes apart; null if that is to be made.
void split(llvm::GetElementPtrInst& access, const llvm::Loop& loop, llvm::Value** held = nullptr) {
  const Address address = parts_of(access, loop);
  llvm::Type* element = access.getSourceElementType();
  llvm::IRBuilder<> before(loop.getLoopPreheader()->getTerminator()), here(&access);
  llvm::Value* start = held ? *held : nullptr;
  if (!start) start = before.CreateGEP(element, address.start, total(before, address.index.fixed));
  if (held && !*held) *held = start = before.CreateFreeze(start);
  llvm::Value* rest =
      here.CreateAdd(total(here, address.index.changing), here.getInt64(address.index.constant));
  access.replaceAllUsesWith(here.CreateGEP(element, start, rest));
  llvm::RecursivelyDeleteTriviallyDeadInstructions(&access);
}

// Replaces addresses by equal ones that were computed before in their block. Copies of an unrolled body may add the same
// terms in another order.
bool share_equal(const llvm::Loop& loop, llvm::ScalarEvolution& evolution) {
  bool changed = false;
  for (llvm::BasicBlock* block : loop.blocks()) {
    std::map<std::tuple<llvm::Value*, llvm::Type*, const llvm::SCEV*>, llvm::Value*> known;
    for (llvm::Instruction& one : *block) {
      auto* access = llvm::dyn_cast<llvm::GetElementPtrInst>(&one);
      if (!access || access->getNumIndices() != 1 || !access->getType()->isPointerTy()) continue;
      const auto [first, is_new] =
          known.try_emplace({access->getOperand(0), access->getSourceElementType(),
                             evolution.getSCEV(access->getOperand(1))},
                            access);
      if (is_new) continue;
      access->replaceAllUsesWith(first->second);
      changed = true;
    }
  }
  return changed;
}

// ---- rows ----

// Pointers that all fit in registers, with counters and the start of the stack.
constexpr size_t most_starts = 12;
// LLVM's code generator finds the addresses of fewer rows by itself.
constexpr size_t least_starts = 6;

struct Start {
  llvm::Value* pointer;
  const llvm::SCEV* offset;
  auto operator<=>(const Start&) const = default;
};

Start start_of(const Address& address, llvm::ScalarEvolution& evolution) {
  const llvm::SCEV* sum = evolution.getZero(llvm::Type::getInt64Ty(evolution.getContext()));
  for (const Term& term : address.index.fixed) {
    const llvm::SCEV* value = evolution.getSCEV(term.value);
    sum = term.is_negative ? evolution.getMinusSCEV(sum, value) : evolution.getAddExpr(sum, value);
  }
  return {address.start, sum};
}

// Gives each row that the loop walks along a pointer to its start that the code generator does not take apart.
bool hold_starts(const llvm::Loop& loop, llvm::ScalarEvolution& evolution) {
  std::map<Start, llvm::Value*> starts;
  std::vector<std::pair<llvm::GetElementPtrInst*, Start>> accesses;
  for (llvm::GetElementPtrInst* access : find_sums(loop)) {
    if (!llvm::isa<llvm::SCEVAddRecExpr>(evolution.getSCEV(access->getOperand(1)))) continue;
    accesses.emplace_back(access, start_of(parts_of(*access, loop), evolution));
    starts[accesses.back().second] = nullptr;
  }
  if (starts.size() < least_starts || starts.size() > most_starts) return false;
  for (const auto& [access, start] : accesses) split(*access, loop, &starts[start]);
  return true;
}

}  // namespace

llvm::PreservedAnalyses HoldRowStarts::run(llvm::Function& function,
                                           llvm::FunctionAnalysisManager& analyses) {
  auto& evolution = analyses.getResult<llvm::ScalarEvolutionAnalysis>(function);
  bool changed = false;
  for (llvm::Loop* loop : analyses.getResult<llvm::LoopAnalysis>(function).getLoopsInPreorder()) {
    if (loop->isInnermost() && loop->getLoopPreheader()) changed |= hold_starts(*loop, evolution);
  }
  return changed ? llvm::PreservedAnalyses::none() : llvm::PreservedAnalyses::all();
}

llvm::PreservedAnalyses SplitAddresses::run(llvm::Function& function,
                                            llvm::FunctionAnalysisManager& analyses) {
  auto& evolution = analyses.getResult<llvm::ScalarEvolutionAnalysis>(function);
  bool changed = false;
  for (llvm::Loop* loop : analyses.getResult<llvm::LoopAnalysis>(function).getLoopsInPreorder()) {
    if (!loop->isInnermost() || !loop->getLoopPreheader()) continue;
    changed |= share_equal(*loop, evolution);
    for (llvm::GetElementPtrInst* address : find_sums(*loop)) {
      // The code generator splits sums that grow by a constant step.
      if (llvm::isa<llvm::SCEVAddRecExpr>(evolution.getSCEV(address->getOperand(1)))) continue;
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
