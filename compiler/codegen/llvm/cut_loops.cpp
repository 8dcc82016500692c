#include "codegen/llvm/cut_loops.h"

#include <llvm/ADT/STLExtras.h>
#include <llvm/Analysis/CaptureTracking.h>
#include <llvm/Analysis/LoopInfo.h>
#include <llvm/IR/Dominators.h>
#include <llvm/IR/IRBuilder.h>
#include <llvm/IR/InstIterator.h>
#include <llvm/IR/Module.h>
#include <llvm/IR/PatternMatch.h>
#include <llvm/Transforms/Utils/CodeExtractor.h>

#include <algorithm>
#include <string>
#include <vector>

namespace retrograde::codegen {
namespace {

// In instructions. Splitting shorter functions is not worth a thread each; shorter pieces gain nothing.
constexpr unsigned long_function = 400, least_piece = 100;
// Least work per execution of a loop, in instructions. A cut costs 20 to some 100 instructions: a call, its arguments,
// and code that LLVM can no longer hoist, such as address parts that are invariant in an enclosing loop. Loops with
// unknown bounds may run only once. Matrix products whose innermost loops were cut at 4,000 took 1.5 times as long;
// depthwise convolutions took 1.25 times as long when unknown extents counted as 16.
constexpr uint64_t least_work = 16000;
constexpr uint64_t unknown_iterations = 4;
// Capacity of a processor's vector registers, in bytes.
constexpr uint64_t register_bytes = 2048;
// Limit on the uses of one allocation that are examined. Unrolled tiles use their accumulators hundreds of times, and
// LLVM's default is 100.
constexpr unsigned most_uses = 10000;

using Blocks = std::vector<llvm::BasicBlock*>;

unsigned length_of(const llvm::Loop& loop) {
  size_t length = 0;
  for (const llvm::BasicBlock* block : loop.blocks()) length += block->size();
  return static_cast<unsigned>(length);
}

// Iteration count of a loop that serial_loop made, which counts up from `first` while the next value is less than
// `end`.
uint64_t iterations_of(const llvm::Loop& loop) {
  using namespace llvm::PatternMatch;
  namespace pattern = llvm::PatternMatch;  // ir has a match, too
  const llvm::BasicBlock* latch = loop.getLoopLatch();
  const auto* counter = llvm::dyn_cast<llvm::PHINode>(&loop.getHeader()->front());
  llvm::ICmpInst::Predicate predicate;
  llvm::Value *next, *end;
  if (!latch || !counter ||
      !pattern::match(latch->getTerminator(), m_Br(m_ICmp(predicate, m_Value(next), m_Value(end)),
                                                   m_BasicBlock(), m_BasicBlock())))
    return unknown_iterations;
  const llvm::ConstantInt *first, *last;
  const llvm::Value* start = nullptr;
  for (unsigned i = 0; i < counter->getNumIncomingValues(); i++) {
    if (counter->getIncomingBlock(i) != latch) start = counter->getIncomingValue(i);
  }
  if ((first = llvm::dyn_cast_or_null<llvm::ConstantInt>(start)) &&
      (last = llvm::dyn_cast<llvm::ConstantInt>(end)))
    return static_cast<uint64_t>(
        std::max<int64_t>(last->getSExtValue() - first->getSExtValue(), 1));
  llvm::ConstantInt* extent;
  if (start && pattern::match(end, m_Add(m_Specific(start), m_ConstantInt(extent))))
    return static_cast<uint64_t>(std::max<int64_t>(extent->getSExtValue(), 1));
  return unknown_iterations;
}

// Instructions that one execution of the loop runs, approximately.
uint64_t work_of(const llvm::Loop& loop) {
  uint64_t work = length_of(loop);
  for (const llvm::Loop* inner : loop) work += work_of(*inner) - length_of(*inner);
  return work * iterations_of(loop);
}

// The blocks of the loop, and the exit blocks that end the function.
Blocks blocks_of(const llvm::Loop& loop) {
  Blocks blocks(loop.block_begin(), loop.block_end());
  llvm::SmallVector<llvm::BasicBlock*> exits;
  loop.getUniqueExitBlocks(exits);
  for (llvm::BasicBlock* exit : exits) {
    const llvm::BasicBlock* next = exit->getSingleSuccessor();
    const bool ends = next && llvm::isa<llvm::PHINode>(next->front()) &&
                      llvm::isa<llvm::ReturnInst>(next->getTerminator());
    if (ends && exit->getSinglePredecessor() && !llvm::isa<llvm::PHINode>(exit->front()))
      blocks.push_back(exit);
  }
  return blocks;
}

bool may_be_registers(const llvm::AllocaInst& block) {
  const auto size = block.getAllocationSize(block.getModule()->getDataLayout());
  return size && size->getFixedValue() <= register_bytes &&
         !llvm::PointerMayBeCaptured(&block, /*ReturnCaptures=*/true, /*StoreCaptures=*/true,
                                     most_uses);
}

bool is_scratch(const llvm::AllocaInst& block) { return block.hasMetadata(scratch_mark); }

// The lifetime marker of a stack allocation, if it has one.
llvm::Instruction* beginning_of(const llvm::AllocaInst& block) {
  for (const llvm::User* user : block.users()) {
    auto* one = const_cast<llvm::Instruction*>(llvm::cast<llvm::Instruction>(user));
    if (one->isLifetimeStartOrEnd()) return one;
  }
  return nullptr;
}

// A stack allocation that only one loop uses and whose lifetime begins anew in each iteration.
struct OwnMemory {
  llvm::AllocaInst* block;
  llvm::Instruction* begins_before;
};

class Cutter {
 public:
  explicit Cutter(llvm::Function& function)
      : function_(function), dominators_(function), loops_(dominators_) {}

  // Returns the new function, or null if no loop is worth a cut.
  llvm::Function* cut(const std::string& name) {
    const llvm::Loop* loop = best_loop();
    if (!loop) return nullptr;
    const Blocks blocks = blocks_of(*loop);
    const std::vector<OwnMemory> own = take_own_memory(blocks);
    const llvm::CodeExtractorAnalysisCache cache(function_);
    llvm::Function* piece = extractor(blocks, name).extractCodeRegion(cache);
    if (piece) move_memory(*piece, own);
    return piece;
  }

 private:
  using ValueSet = llvm::SetVector<llvm::Value*>;
  llvm::Function& function_;
  llvm::DominatorTree dominators_;
  llvm::LoopInfo loops_;

  llvm::CodeExtractor extractor(const Blocks& blocks, const std::string& name) {
    return llvm::CodeExtractor(blocks, &dominators_, /*AggregateArgs=*/false, nullptr, nullptr,
                               nullptr, /*AllowVarArgs=*/false, /*AllowAlloca=*/false, nullptr,
                               name);
  }

  const llvm::Loop* best_loop() {
    const unsigned whole = function_.getInstructionCount();
    const llvm::Loop* best = nullptr;
    unsigned smaller_piece = std::max(least_piece, whole / 8);
    for (const llvm::Loop* loop : loops_.getLoopsInPreorder()) {
      const unsigned length = length_of(*loop);
      if (length > whole || std::min(length, whole - length) < smaller_piece) continue;
      if (work_of(*loop) < least_work || !can_cut(*loop)) continue;
      best = loop;
      smaller_piece = std::min(length, whole - length) + 1;
    }
    return best;
  }

  bool can_cut(const llvm::Loop& loop) {
    const Blocks blocks = blocks_of(loop);
    const llvm::CodeExtractor region = extractor(blocks, "");
    if (!region.isEligible()) return false;
    ValueSet inputs, outputs;
    region.findInputsOutputs(inputs, outputs, {});
    const bool gives_codes = llvm::all_of(
        outputs, [](const llvm::Value* value) { return value->getType()->isIntegerTy(32); });
    return gives_codes &&
           llvm::none_of(inputs, [&](const llvm::Value* v) { return is_shared(v, blocks); });
  }

  // Whether the value may live in a register on both sides of the cut.
  static bool is_shared(const llvm::Value* input, const Blocks& blocks) {
    if (input->getType()->isVectorTy()) return true;
    const auto* block = llvm::dyn_cast<llvm::AllocaInst>(input);
    return block && !is_scratch(*block) && !is_own(*block, blocks) && may_be_registers(*block);
  }

  static bool is_own(const llvm::AllocaInst& block, const Blocks& blocks) {
    return beginning_of(block) && llvm::all_of(block.users(), [&](const llvm::User* user) {
             return llvm::is_contained(blocks, llvm::cast<llvm::Instruction>(user)->getParent());
           });
  }

  // Removes the lifetime markers, which the extractor would otherwise put around the call.
  static std::vector<OwnMemory> take_own_memory(const Blocks& blocks) {
    std::vector<OwnMemory> own;
    for (llvm::BasicBlock* where : blocks) {
      for (llvm::Instruction& one : llvm::make_early_inc_range(*where)) {
        if (!one.isLifetimeStartOrEnd()) continue;
        auto* block = llvm::dyn_cast<llvm::AllocaInst>(one.getOperand(1));
        if (!block || !is_own(*block, blocks)) continue;
        llvm::Instruction* next = one.getNextNode();
        while (next->isLifetimeStartOrEnd()) next = next->getNextNode();
        own.push_back({block, next});
        one.eraseFromParent();
      }
    }
    return own;
  }

  // Moves the loop's own memory into the piece, and gives the piece its own scratch memory.
  static void move_memory(llvm::Function& piece, const std::vector<OwnMemory>& own) {
    auto* call = llvm::cast<llvm::CallInst>(*piece.user_begin());
    llvm::Instruction* const begin = &*piece.getEntryBlock().getFirstInsertionPt();
    const auto give = [&](llvm::AllocaInst* block, llvm::Argument* argument) {
      call->setArgOperand(argument->getArgNo(), llvm::PoisonValue::get(block->getType()));
      llvm::Instruction* its = block;
      if (block->use_empty())
        block->moveBefore(begin);
      else
        (its = block->clone())->insertBefore(begin);
      argument->replaceAllUsesWith(its);
    };
    for (llvm::Argument& argument : piece.args()) {
      auto* block = llvm::dyn_cast<llvm::AllocaInst>(call->getArgOperand(argument.getArgNo()));
      if (block && (is_scratch(*block) || is_among(*block, own))) give(block, &argument);
    }
    for (const OwnMemory& memory : own)
      llvm::IRBuilder<>(memory.begins_before).CreateLifetimeStart(memory.block);
  }

  static bool is_among(const llvm::AllocaInst& block, const std::vector<OwnMemory>& own) {
    return llvm::any_of(own, [&](const OwnMemory& memory) { return memory.block == &block; });
  }
};

void cut(llvm::Function& function, unsigned longest) {
  std::vector<llvm::Function*> rest{&function};
  unsigned count = 0;
  while (!rest.empty()) {
    llvm::Function* const f = rest.back();
    rest.pop_back();
    if (f->getInstructionCount() <= longest) continue;
    llvm::Function* const piece = Cutter(*f).cut("loop" + std::to_string(count++));
    if (!piece) continue;
    rest.push_back(piece);
    rest.push_back(f);
  }
}

// LLVM's passes do not need them.
void drop_lifetime_markers(llvm::Module& module) {
  for (llvm::Function& function : module) {
    for (llvm::Instruction& one : llvm::make_early_inc_range(llvm::instructions(function))) {
      if (one.isLifetimeStartOrEnd()) one.eraseFromParent();
    }
  }
}

}  // namespace

void cut_loops(llvm::Module& module) {
  const unsigned longest = std::max(long_function, module.getInstructionCount() / 3);
  std::vector<llvm::Function*> functions;
  for (llvm::Function& function : module) {
    if (!function.isDeclaration()) functions.push_back(&function);
  }
  for (llvm::Function* function : functions) cut(*function, longest);
  drop_lifetime_markers(module);
}

}  // namespace retrograde::codegen
