// A short pipeline, because the schedule has decided what LLVM's standard one would guess at:
// vector widths, unrolling and inlining are done. What is left is scalar: per function, in this
// order,
//
//   SROA           slots of owned blocks and small allocations become registers
//   EarlyCSE       the same subexpression in several statements; loads of closures and descriptors
//   SimplifyCFG    blocks of asserts and scopes that turned out empty
//   InstCombine    address arithmetic, comparisons with constants, shuffles of shuffles
//   LICM           loop-invariant loads and address parts, past unrelated stores
//   SplitAddresses what a loop does not change of an address is added before it
//   GVN            loads that an earlier iteration's tail or another block already did, where
//                  EarlyCSE is too local
//   LoopLoadElim   what a scan stored in the iteration before stays in a register
//   DSE            stores that a later one replaces: the steps of an unrolled sum, of which GVN has
//                  taken the loads
//   LoopUnroll     loops of few iterations altogether, other small innermost ones two or four times,
//                  unless short iterations wait for a sum of floats
//   SROA, EarlyCSE allocations of which only such a loop hid the places; what it loaded twice
//   InstCombine, SimplifyCFG, ADCE to clean up
//   cut_long_blocks and FenceLongBlocks, so that LLVM's code generator takes linear time
//
// Left out: loop and SLP vectorization, inlining, loop idioms (a memset call is slower on the short
// rows that schedules produce). Strength reduction of addresses is part of LLVM's code generator.
#include "codegen/optimize.h"

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

#include "codegen/cut_long_blocks.h"
#include "codegen/fence_long_blocks.h"
#include "codegen/split_addresses.h"

namespace retrograde::codegen {

// About how many instructions of the machine a block is: addresses and conversions of indices fold
// into what uses them, vectors wider than a register count as often as they have registers.
static unsigned cost_of(const llvm::BasicBlock& block) {
  constexpr unsigned register_bits = 256;
  unsigned cost = 0;
  for (const llvm::Instruction& one : block) {
    if (llvm::isa<llvm::PHINode, llvm::GetElementPtrInst, llvm::CastInst>(one)) continue;
    const auto* store = llvm::dyn_cast<llvm::StoreInst>(&one);
    const llvm::Type* type = store ? store->getValueOperand()->getType() : one.getType();
    const auto bits = static_cast<unsigned>(type->getPrimitiveSizeInBits().getFixedValue());
    cost += std::max(1u, bits / register_bits);
  }
  return cost;
}

// What a loop adds to its counter, compares and jumps.
constexpr unsigned counting = 3;
// The most that a loop without a loop in it, copied as often as it runs, may grow to. Loops over
// the lanes of a vector of bytes, as borders have them, stay compact; those that store nothing, as
// sums over the lanes of partial sums, may run as often: their operands become registers.
constexpr unsigned most_unrolled = 160, few_iterations = 16, few_without_stores = 64;

static bool stores(const llvm::Loop& loop) {
  return llvm::any_of(loop.blocks(), [](const llvm::BasicBlock* block) {
    return llvm::any_of(*block, [](const auto& one) { return one.mayWriteToMemory(); });
  });
}

// A loop of few iterations, whose number is known, is copied for each; the loops in it first. Its
// cost as straight code, or nothing where it stays a loop.
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

// Whether e is computed from the phi, in floating point, within the block.
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

// Whether iterations wait for what the one before adds up in floating point. Beside that, counting takes no
// time where the body is short.
static bool adds_up_floats(const llvm::BasicBlock& body) {
  return llvm::any_of(body.phis(), [&](const llvm::PHINode& phi) {
    const int latch = phi.getBasicBlockIndex(&body);
    if (latch < 0 || !phi.getType()->isFPOrFPVectorTy()) return false;
    const llvm::Value* next = phi.getIncomingValue(static_cast<unsigned>(latch));
    return next != &phi && follows_from(next, phi);
  });
}

// Copies of the body of a small innermost loop, where counting costs a good part of the work. Iterations
// that are left over run in a loop of their own, whose addresses are computed apart: loops that run
// a few times would spend as much on that.
static unsigned unroll_count(const llvm::Loop& loop, llvm::ScalarEvolution& evolution) {
  constexpr unsigned room = 48, least_iterations = 8;
  constexpr size_t during_a_sum = 20;  // instructions that take no longer than one addition
  if (!loop.isInnermost() || loop.getNumBlocks() != 1) return 1;
  const unsigned most = evolution.getSmallConstantMaxTripCount(&loop);  // 0: unknown
  if (most > 0 && most < least_iterations) return 1;
  const llvm::BasicBlock& body = *loop.getHeader();
  if (body.size() <= during_a_sum && adds_up_floats(body)) return 1;
  const bool calls = std::any_of(body.begin(), body.end(), [](const llvm::Instruction& one) {
    return llvm::isa<llvm::CallBase>(one) && !llvm::isa<llvm::IntrinsicInst>(one);
  });
  const unsigned cost = cost_of(body);
  return calls || cost * 2 > room ? 1 : cost * 4 > room ? 2 : 4;
}

// Tells LoopUnroll what to do: it follows nothing but these marks.
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
    // Kernels of devices are short, and have no fences of the own thread.
    if (!machine.getTargetTriple().isNVPTX()) shorten_blocks(*function, functions);
  }
}

}  // namespace retrograde::codegen
