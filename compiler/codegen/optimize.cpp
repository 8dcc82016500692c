// A short pipeline, because the schedule has decided what LLVM's standard one would guess at:
// vector widths, unrolling and inlining are done. What is left is scalar: per function, in this
// order,
//
//   SROA           slots of owned blocks and small allocations become registers
//   EarlyCSE       the same subexpression in several statements; loads of closures and descriptors
//   SimplifyCFG    blocks of asserts and scopes that turned out empty
//   InstCombine    address arithmetic, comparisons with constants, shuffles of shuffles
//   LICM           loop-invariant loads and address parts, past unrelated stores
//   GVN            loads that an earlier iteration's tail or another block already did, where
//                  EarlyCSE is too local
//   LoopLoadElim   what a scan stored in the iteration before stays in a register
//   DSE            stores that a later one replaces: the steps of an unrolled sum, of which GVN has
//                  taken the loads
//   LoopUnroll     short innermost loops over scalars
//   SROA           allocations of which only such a loop hid the places
//   InstCombine, SimplifyCFG, ADCE to clean up
//
// Left out: loop and SLP vectorization, inlining, loop idioms (a memset call is slower on the short
// rows that schedules produce). Strength reduction of addresses is part of LLVM's code generator.
#include "codegen/optimize.h"

#include <llvm/Analysis/LoopInfo.h>
#include <llvm/Analysis/ScalarEvolution.h>
#include <llvm/Analysis/TargetTransformInfo.h>
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

namespace retrograde::codegen {

// Iterations of a loop in one copy of its body, 1 where it stays as it is. One that always runs a
// few times is no loop afterwards, and what it passes through memory may be registers. Of the
// others those over scalars, where counting costs as much as the work.
static unsigned unroll_count(const llvm::Loop& loop, llvm::ScalarEvolution& evolution) {
  constexpr size_t most_instructions = 20, most_in_all = 256, most_of_vectors = 64;
  if (!loop.isInnermost() || loop.getNumBlocks() != 1) return 1;
  const llvm::BasicBlock& body = *loop.getHeader();
  if (body.size() > most_instructions) return 1;
  const bool has_calls = std::any_of(body.begin(), body.end(), [](const llvm::Instruction& one) {
    return llvm::isa<llvm::CallBase>(one);
  });
  if (has_calls) return 1;
  const bool is_scalar = std::none_of(body.begin(), body.end(), [](const llvm::Instruction& one) {
    return one.getType()->isVectorTy();
  });
  const unsigned times = evolution.getSmallConstantTripCount(&loop);
  const size_t in_all = times * body.size();
  if (times > 0 && in_all <= (is_scalar ? most_in_all : most_of_vectors)) return times;
  return is_scalar ? 4 : 1;
}

// Tells LoopUnroll what to do: it follows nothing but these marks.
class MarkSmallLoops : public llvm::PassInfoMixin<MarkSmallLoops> {
 public:
  llvm::PreservedAnalyses run(llvm::Function& function, llvm::FunctionAnalysisManager& analyses) {
    auto& evolution = analyses.getResult<llvm::ScalarEvolutionAnalysis>(function);
    for (llvm::Loop* loop : analyses.getResult<llvm::LoopAnalysis>(function).getLoopsInPreorder()) {
      const unsigned count = unroll_count(*loop, evolution);
      if (count > 1) llvm::addStringMetadataToLoop(loop, "llvm.loop.unroll.count", count);
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
  passes.addPass(llvm::GVNPass());
  passes.addPass(llvm::LoopLoadEliminationPass());
  passes.addPass(llvm::DSEPass());
  passes.addPass(MarkSmallLoops());
  passes.addPass(llvm::LoopUnrollPass(llvm::LoopUnrollOptions(2, /*OnlyWhenForced=*/true)));
  passes.addPass(llvm::SROAPass(llvm::SROAOptions::PreserveCFG));
  passes.addPass(llvm::InstCombinePass());
  passes.addPass(llvm::SimplifyCFGPass());
  passes.addPass(llvm::ADCEPass());
  return passes;
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
  for (llvm::Function& function : module) {
    if (!function.isDeclaration()) passes.run(function, functions);
  }
}

}  // namespace retrograde::codegen
