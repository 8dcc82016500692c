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
//   LoopUnroll     short innermost loops over scalars
//   InstCombine, SimplifyCFG, ADCE to clean up
//
// Left out: loop and SLP vectorization, inlining, loop idioms (a memset call is slower on the short
// rows that schedules produce). Strength reduction of addresses is part of LLVM's code generator.
#include "codegen/optimize.h"

#include <llvm/Analysis/LoopInfo.h>
#include <llvm/Analysis/TargetTransformInfo.h>
#include <llvm/IR/Module.h>
#include <llvm/Passes/PassBuilder.h>
#include <llvm/Target/TargetMachine.h>
#include <llvm/Transforms/InstCombine/InstCombine.h>
#include <llvm/Transforms/Scalar/ADCE.h>
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

// Copies of the body of a loop. Only of loops over scalars, where counting costs as much as the
// work: the others do enough in one iteration.
static unsigned unroll_count(const llvm::Loop& loop) {
  constexpr size_t most_instructions = 20;
  if (!loop.isInnermost() || loop.getNumBlocks() != 1) return 1;
  const llvm::BasicBlock& body = *loop.getHeader();
  if (body.size() > most_instructions) return 1;
  const bool is_scalar = std::none_of(body.begin(), body.end(), [](const llvm::Instruction& one) {
    return one.getType()->isVectorTy() || llvm::isa<llvm::CallBase>(one);
  });
  return is_scalar ? 4 : 1;
}

// Tells LoopUnroll what to do: it follows nothing but these marks.
class MarkSmallLoops : public llvm::PassInfoMixin<MarkSmallLoops> {
 public:
  llvm::PreservedAnalyses run(llvm::Function& function, llvm::FunctionAnalysisManager& analyses) {
    for (llvm::Loop* loop : analyses.getResult<llvm::LoopAnalysis>(function).getLoopsInPreorder()) {
      const unsigned count = unroll_count(*loop);
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
  passes.addPass(MarkSmallLoops());
  passes.addPass(llvm::LoopUnrollPass(llvm::LoopUnrollOptions(2, /*OnlyWhenForced=*/true)));
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
