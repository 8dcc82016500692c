// LLVM's passes over generated code. The pipeline is short because the schedule has already decided vector widths,
// unrolling and inlining, at which LLVM's standard pipeline would guess. Scalar optimization remains; each function
// goes through, in this order,
//
//   SROA           slots of owned blocks and small allocations become registers
//   EarlyCSE       the same subexpression in several statements; loads of closures and descriptors
//   SimplifyCFG    blocks of asserts and scopes that turned out to be empty
//   InstCombine    address arithmetic, comparisons with constants, shuffles of shuffles
//   LICM           loop-invariant loads and address parts, past unrelated stores
//   SplitAddresses loop-invariant parts of addresses are added before the loop
//   GVN            loads that an earlier iteration's tail or another block already did, where
//                  EarlyCSE is too local
//   LoopLoadElim   a value that a scan stored in the previous iteration stays in a register
//   DSE            stores that a later one overwrites: the steps of an unrolled sum, whose loads GVN
//                  has removed
//   LoopUnroll     fully unrolls loops of few iterations; unrolls other small innermost loops by two
//                  or four, unless short iterations wait for a sum of floats
//   SROA, EarlyCSE allocations whose indices only such a loop hid; repeated loads in its copies
//   InstCombine, SimplifyCFG, ADCE to clean up
//   HoldRowStarts  the first addresses of many rows stay in registers
//   cut_long_blocks and FenceLongBlocks, so that LLVM's code generator takes linear time
//
// Left out: loop and SLP vectorization, inlining, and loop idioms (a memset call is slower on the short rows that
// schedules produce). LLVM's code generator does strength reduction of addresses.
#include "codegen/llvm/optimize.h"

#include <llvm/ADT/STLExtras.h>
#include <llvm/Analysis/LoopInfo.h>
#include <llvm/Analysis/ScalarEvolution.h>
#include <llvm/Analysis/TargetTransformInfo.h>
#include <llvm/IR/IntrinsicInst.h>
#include <llvm/IR/Module.h>
#include <llvm/Passes/PassBuilder.h>
#include <llvm/Target/TargetMachine.h>
#include <llvm/Transforms/InstCombine/InstCombine.h>
#include <llvm/Transforms/Scalar/ADCE.h>
#include <llvm/Transforms/Scalar/DeadStoreElimination.h>
#include <llvm/Transforms/Scalar/EarlyCSE.h>
#include <llvm/Transforms/Scalar/GVN.h>
#include <llvm/Transforms/Scalar/LICM.h>
#include <llvm/Transforms/Scalar/LoopLoadElimination.h>
#include <llvm/Transforms/Scalar/LoopPassManager.h>
#include <llvm/Transforms/Scalar/LoopUnrollPass.h>
#include <llvm/Transforms/Scalar/SROA.h>
#include <llvm/Transforms/Scalar/SimplifyCFG.h>
#include <llvm/Transforms/Utils/LoopUtils.h>

#include <algorithm>
#include <optional>
#include <vector>

#include "codegen/llvm/cut_long_blocks.h"
#include "codegen/llvm/fence_long_blocks.h"
#include "codegen/llvm/split_addresses.h"

namespace retrograde::codegen {

// A product and its sum count as two, fused or not, so that machines with FMA unroll as others do.
static unsigned operations_of(const llvm::Instruction& one) {
  const auto* call = llvm::dyn_cast<llvm::IntrinsicInst>(&one);
  return call && call->getIntrinsicID() == llvm::Intrinsic::fmuladd ? 2 : 1;
}

static size_t operations_of(const llvm::BasicBlock& block) {
  size_t count = 0;
  for (const llvm::Instruction& one : block) count += operations_of(one);
  return count;
}

// Approximate number of machine instructions of a block. Addresses and index conversions fold into their users. A
// vector wider than a register counts once per register.
static unsigned cost_of(const llvm::BasicBlock& block) {
  constexpr unsigned register_bits = 256;
  unsigned cost = 0;
  for (const llvm::Instruction& one : block) {
    if (llvm::isa<llvm::PHINode, llvm::GetElementPtrInst, llvm::CastInst>(one)) continue;
    const auto* store = llvm::dyn_cast<llvm::StoreInst>(&one);
    const llvm::Type* type = store ? store->getValueOperand()->getType() : one.getType();
    const auto bits = static_cast<unsigned>(type->getPrimitiveSizeInBits().getFixedValue());
    cost += std::max(1u, bits / register_bits) * operations_of(one);
  }
  return cost;
}

// Cost of a loop's increment, compare and jump.
constexpr unsigned counting = 3;
// Largest cost to which full unrolling may grow a loop nest. Loops over the lanes of a byte vector, as border
// iterations have them, stay compact. Loops without stores, such as sums over the lanes of partial sums, may have more
// iterations, because their operands become registers.
constexpr unsigned most_unrolled = 160, few_iterations = 16, few_without_stores = 64;

static bool stores(const llvm::Loop& loop) {
  return llvm::any_of(loop.blocks(), [](const llvm::BasicBlock* block) {
    return llvm::any_of(*block, [](const auto& one) { return one.mayWriteToMemory(); });
  });
}

// The cost of the loop as straight-line code, if it is to be fully unrolled; inner loops count as unrolled first.
// Nothing if it stays a loop.
static std::optional<unsigned> unrolled_cost(const llvm::Loop& loop,
                                             llvm::ScalarEvolution& evolution) {
  const unsigned count = evolution.getSmallConstantTripCount(&loop);
  if (count == 0 || count > few_without_stores || !loop.getExitingBlock()) return std::nullopt;
  if (count > few_iterations && stores(loop)) return std::nullopt;
  unsigned cost = 0;
  for (const llvm::Loop* inner : loop.getSubLoops()) {
    const auto inner_cost = unrolled_cost(*inner, evolution);
    if (!inner_cost) return std::nullopt;
    cost += *inner_cost;
  }
  for (const llvm::BasicBlock* block : loop.blocks()) {
    const bool is_own = std::none_of(
        loop.begin(), loop.end(), [&](const llvm::Loop* inner) { return inner->contains(block); });
    if (is_own) cost += cost_of(*block);
  }
  cost -= std::min(cost, counting);
  return cost * count <= most_unrolled ? std::optional<unsigned>(cost * count) : std::nullopt;
}

// Whether e is computed from the phi by floating-point operations within the block.
static bool follows_from(const llvm::Value* e, const llvm::PHINode& phi) {
  llvm::SmallPtrSet<const llvm::Value*, 32> follow = {&phi};
  for (const llvm::Instruction& one : *phi.getParent()) {
    const bool is_next =
        llvm::any_of(one.operands(), [&](const llvm::Use& use) { return follow.contains(use); });
    if (is_next && !llvm::isa<llvm::PHINode>(one) && one.getType()->isFPOrFPVectorTy())
      follow.insert(&one);
  }
  return follow.contains(e);
}

// Whether each iteration waits for a floating-point sum of the previous one. Then counting is free if the body is
// short.
static bool adds_up_floats(const llvm::BasicBlock& body) {
  return llvm::any_of(body.phis(), [&](const llvm::PHINode& phi) {
    const int latch = phi.getBasicBlockIndex(&body);
    if (latch < 0 || !phi.getType()->isFPOrFPVectorTy()) return false;
    const llvm::Value* next = phi.getIncomingValue(static_cast<unsigned>(latch));
    return next != &phi && follows_from(next, phi);
  });
}

// Unroll factor of a small innermost loop, in which counting is a good part of the work. Remainder iterations run in an
// epilogue loop that computes its own addresses; loops with few iterations would lose as much on that.
static unsigned unroll_count(const llvm::Loop& loop, llvm::ScalarEvolution& evolution) {
  constexpr unsigned room = 48, least_iterations = 8;
  constexpr size_t during_a_sum = 20;  // instructions that take no longer than one addition
  if (!loop.isInnermost() || loop.getNumBlocks() != 1) return 1;
  const unsigned most = evolution.getSmallConstantMaxTripCount(&loop);  // 0: unknown
  if (most > 0 && most < least_iterations) return 1;
  const llvm::BasicBlock& body = *loop.getHeader();
  if (operations_of(body) <= during_a_sum && adds_up_floats(body)) return 1;
  const bool calls = std::any_of(body.begin(), body.end(), [](const llvm::Instruction& one) {
    return llvm::isa<llvm::CallBase>(one) && !llvm::isa<llvm::IntrinsicInst>(one);
  });
  const unsigned cost = cost_of(body);
  return calls || cost * 2 > room ? 1 : cost * 4 > room ? 2 : 4;
}

// Marks the loops that LoopUnroll is to unroll: it obeys only these marks.
class MarkSmallLoops : public llvm::PassInfoMixin<MarkSmallLoops> {
 public:
  llvm::PreservedAnalyses run(llvm::Function& function, llvm::FunctionAnalysisManager& analyses) {
    auto& evolution = analyses.getResult<llvm::ScalarEvolutionAnalysis>(function);
    for (llvm::Loop* loop : analyses.getResult<llvm::LoopAnalysis>(function).getLoopsInPreorder()) {
      if (unrolled_cost(*loop, evolution)) {
        llvm::addStringMetadataToLoop(loop, "llvm.loop.unroll.full", 1);
      } else if (const unsigned count = unroll_count(*loop, evolution); count > 1) {
        llvm::addStringMetadataToLoop(loop, "llvm.loop.unroll.count", count);
      }
    }
    return llvm::PreservedAnalyses::all();
  }
};

static llvm::FunctionPassManager pipeline() {
  llvm::FunctionPassManager passes;
  passes.addPass(llvm::SROAPass(llvm::SROAOptions::ModifyCFG));
  passes.addPass(llvm::EarlyCSEPass(true));
  passes.addPass(llvm::SimplifyCFGPass());
  passes.addPass(llvm::InstCombinePass());
  passes.addPass(llvm::createFunctionToLoopPassAdaptor(llvm::LICMPass(llvm::LICMOptions()),
                                                       /*UseMemorySSA=*/true));
  passes.addPass(SplitAddresses());
  passes.addPass(llvm::GVNPass());
  passes.addPass(llvm::LoopLoadEliminationPass());
  passes.addPass(llvm::DSEPass());
  passes.addPass(MarkSmallLoops());
  passes.addPass(llvm::LoopUnrollPass(llvm::LoopUnrollOptions(2, /*OnlyWhenForced=*/true)));
  passes.addPass(llvm::SROAPass(llvm::SROAOptions::PreserveCFG));
  passes.addPass(llvm::EarlyCSEPass(false));
  passes.addPass(llvm::InstCombinePass());
  passes.addPass(llvm::SimplifyCFGPass());
  passes.addPass(llvm::ADCEPass());
  passes.addPass(HoldRowStarts());
  return passes;
}

static void shorten_blocks(llvm::Function& function, llvm::FunctionAnalysisManager& analyses) {
  std::vector<llvm::Function*> pieces = cut_long_blocks(function);
  pieces.push_back(&function);
  for (llvm::Function* piece : pieces) {
    FenceLongBlocks().run(*piece, analyses);
    analyses.invalidate(*piece, llvm::PreservedAnalyses::none());
  }
}

void optimize(llvm::Module& module, llvm::TargetMachine& machine) {
  llvm::LoopAnalysisManager loops;
  llvm::FunctionAnalysisManager functions;
  llvm::CGSCCAnalysisManager call_graph;
  llvm::ModuleAnalysisManager modules;
  llvm::PassBuilder builder(&machine);
  builder.registerModuleAnalyses(modules);
  builder.registerCGSCCAnalyses(call_graph);
  builder.registerFunctionAnalyses(functions);
  builder.registerLoopAnalyses(loops);
  builder.crossRegisterProxies(loops, functions, call_graph, modules);
  llvm::FunctionPassManager passes = pipeline();
  std::vector<llvm::Function*> defined;
  for (llvm::Function& function : module) {
    if (!function.isDeclaration()) defined.push_back(&function);
  }
  for (llvm::Function* function : defined) {
    passes.run(*function, functions);
    // GPU kernels are short, and NVPTX cannot select single-thread fences.
    if (!machine.getTargetTriple().isNVPTX()) shorten_blocks(*function, functions);
  }
}

}  // namespace retrograde::codegen
