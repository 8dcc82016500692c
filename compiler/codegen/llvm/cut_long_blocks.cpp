#include "codegen/llvm/cut_long_blocks.h"

#include <llvm/ADT/DenseMap.h>
#include <llvm/ADT/STLExtras.h>
#include <llvm/ADT/SetVector.h>
#include <llvm/IR/IRBuilder.h>
#include <llvm/IR/InstrTypes.h>
#include <llvm/IR/IntrinsicInst.h>
#include <llvm/IR/Module.h>

#include <map>
#include <utility>

namespace retrograde::codegen {
namespace {

constexpr size_t most_instructions = 4096, piece_length = 1024;

using llvm::Instruction;
using Instructions = std::vector<Instruction*>;

bool stays(const Instruction& one) {
  return llvm::isa<llvm::PHINode, llvm::AllocaInst>(one) || one.isTerminator();
}

// Instructions that cannot move to another function.
bool must_stay_in_function(const Instruction& one) {
  if (const auto* memory = llvm::dyn_cast<llvm::AllocaInst>(&one))
    return !llvm::isa<llvm::ConstantInt>(memory->getArraySize());
  const auto* call = llvm::dyn_cast<llvm::IntrinsicInst>(&one);
  return call && (call->getIntrinsicID() == llvm::Intrinsic::stacksave ||
                  call->getIntrinsicID() == llvm::Intrinsic::stackrestore);
}

bool can_cut(const llvm::BasicBlock& block) {
  return block.size() > most_instructions && llvm::none_of(block, must_stay_in_function);
}

Instructions movable(llvm::BasicBlock& block) {
  Instructions all;
  for (Instruction& one : block) {
    if (!stays(one)) all.push_back(&one);
  }
  return all;
}

// Vector masks, which are recomputed in each piece.
bool is_recomputed(const Instruction& one) {
  return one.getType()->isVectorTy() && one.getType()->getScalarType()->isIntegerTy(1) &&
         llvm::isa<llvm::CmpInst, llvm::BinaryOperator, llvm::FreezeInst>(one);
}

// Instructions that the code generator fuses into their only user if both are in the same block.
bool may_fuse(const Instruction& one) {
  const unsigned opcode = one.getOpcode();
  return one.hasOneUse() && (opcode == Instruction::FMul || opcode == Instruction::FNeg ||
                             opcode == Instruction::FPExt || opcode == Instruction::FPTrunc);
}

// Assigns each instruction of a block to a piece, and moves or copies instructions that must be in the piece of their
// user.
class Division {
 public:
  explicit Division(llvm::BasicBlock& block) : block_(block) {
    const Instructions all = movable(block);
    count_ = std::max<size_t>(all.size() / piece_length, 1);
    const size_t length = (all.size() + count_ - 1) / count_;
    for (size_t i = 0; i < all.size(); i++) places_[all[i]] = {i / length, {i, 0}, all[i]};
    // Users before their operands: an instruction that moves along may need its own operands to move too.
    for (Instruction* one : llvm::reverse(all)) move_with_user(*one);
  }

  std::vector<Instructions> pieces() {
    std::vector<Instructions> pieces(count_);
    for (Instruction* one : movable(block_)) pieces[places_[one].piece].push_back(one);
    return pieces;
  }

 private:
  using Order = std::pair<size_t, int>;
  struct Place {
    size_t piece;
    Order order;
    Instruction* anchor;  // an instruction of the original block; this one is placed before it
  };

  void move_with_user(Instruction& one) {
    if (!may_fuse(one) && !is_recomputed(one)) return;
    for (const auto& [piece, reader] : first_readers(one)) {
      if (piece == places_[&one].piece) continue;
      if (may_fuse(one)) return place_before(*reader, one);
      Instruction* copy = one.clone();
      place_before(*reader, *copy);
      one.replaceUsesWithIf(copy, [&, piece = piece](const llvm::Use& use) {
        const auto place = places_.find(use.getUser());
        return place != places_.end() && place->second.piece == piece;
      });
    }
  }

  std::map<size_t, Instruction*> first_readers(Instruction& one) {
    std::map<size_t, Instruction*> first;
    for (llvm::User* user : one.users()) {
      const auto place = places_.find(user);
      if (place == places_.end()) continue;
      Instruction*& reader = first[place->second.piece];
      if (!reader || place->second.order < places_[reader].order)
        reader = llvm::cast<Instruction>(user);
    }
    return first;
  }

  // Placed before everything that was already placed before the same anchor, since some of that may read it.
  void place_before(Instruction& reader, Instruction& one) {
    const Place there = places_[&reader];
    Instruction*& head = heads_[there.anchor];
    Instruction* const before = head ? head : there.anchor;
    if (one.getParent()) {
      one.moveBefore(before);
    } else {
      one.insertBefore(before);
    }
    head = &one;
    places_[&one] = {there.piece, {there.order.first, --last_}, there.anchor};
  }

  llvm::BasicBlock& block_;
  size_t count_ = 0;
  int last_ = 0;
  llvm::DenseMap<const llvm::Value*, Place> places_;
  llvm::DenseMap<const Instruction*, Instruction*> heads_;
};

class BlockCutter {
 public:
  explicit BlockCutter(llvm::BasicBlock& block)
      : block_(block), function_(*block.getParent()), pieces_(Division(block).pieces()) {
    for (size_t i = 0; i < pieces_.size(); i++) {
      for (Instruction* one : pieces_[i]) piece_[one] = i;
    }
  }

  std::vector<llvm::Function*> cut() {
    find_values_in_frame();
    llvm::IRBuilder<> entry(&*function_.getEntryBlock().getFirstInsertionPt());
    frame_ = entry.CreateAlloca(frame_type_, nullptr, "frame");
    for (const Instructions& piece : pieces_) move_to_function(piece);
    load_values_used_after();
    return std::move(new_functions_);
  }

 private:
  // Gives a slot in the frame to each value that another piece reads.
  void find_values_in_frame() {
    llvm::SmallVector<llvm::Type*> types;
    for (size_t piece = 0; piece < pieces_.size(); piece++) {
      for (Instruction* one : pieces_[piece]) {
        note_elsewhere(*one);
        const bool is_own = llvm::all_of(one->users(), [&](const llvm::User* user) {
          const auto place = piece_.find(user);
          return place != piece_.end() && place->second == piece;
        });
        if (is_own) continue;
        slots_[one] = static_cast<unsigned>(types.size());
        crossing_.push_back(one);
        types.push_back(one->getType());
      }
    }
    frame_type_ = llvm::StructType::get(function_.getContext(), types);
  }

  void note_elsewhere(Instruction& one) {
    for (llvm::Value* operand : one.operands()) {
      if (llvm::isa<llvm::Argument>(operand) ||
          (llvm::isa<Instruction>(operand) && !piece_.contains(operand)))
        elsewhere_.insert(operand);
    }
  }

  void move_to_function(const Instructions& instructions) {
    std::vector<llvm::Value*> arguments{frame_};
    arguments.insert(arguments.end(), elsewhere_.begin(), elsewhere_.end());
    llvm::Function* draft = make_function(arguments);
    inside_.clear();
    for (unsigned i = 1; i < arguments.size(); i++) inside_[arguments[i]] = draft->getArg(i);
    auto* body = llvm::BasicBlock::Create(function_.getContext(), "entry", draft);
    Instruction* const end = llvm::ReturnInst::Create(function_.getContext(), body);
    for (Instruction* one : instructions) {
      one->moveBefore(end);
      read_inside(*one, draft->getArg(0));
    }
    for (Instruction* one : instructions) {
      if (slots_.contains(one)) store(*one, draft->getArg(0));
    }
    llvm::Function* piece = without_unused_arguments(draft, arguments);
    llvm::IRBuilder<>(block_.getTerminator()).CreateCall(piece, arguments);
    new_functions_.push_back(piece);
  }

  // Replaces operands from outside the piece by arguments and loads.
  void read_inside(Instruction& one, llvm::Value* frame) {
    for (llvm::Use& use : one.operands()) {
      auto* computed = llvm::dyn_cast<Instruction>(use.get());
      llvm::Value*& known = inside_[use.get()];
      if (!known && computed && computed->getParent() != one.getParent())
        known = load(*computed, one, frame);
      if (known) use.set(known);
    }
  }

  llvm::Function* make_function(const std::vector<llvm::Value*>& arguments) {
    std::vector<llvm::Type*> types;
    for (const llvm::Value* value : arguments) types.push_back(value->getType());
    auto* type =
        llvm::FunctionType::get(llvm::Type::getVoidTy(function_.getContext()), types, false);
    llvm::Function* result =
        llvm::Function::Create(type, llvm::GlobalValue::InternalLinkage,
                               function_.getName() + ".piece", function_.getParent());
    result->addFnAttrs(
        llvm::AttrBuilder(function_.getContext(), function_.getAttributes().getFnAttrs()));
    return result;
  }

  // The same function without its unused arguments, which are removed from `arguments` too.
  llvm::Function* without_unused_arguments(llvm::Function* draft,
                                           std::vector<llvm::Value*>& arguments) {
    std::vector<llvm::Value*> read;
    std::vector<llvm::Argument*> from;
    for (llvm::Argument& argument : draft->args()) {
      if (argument.use_empty()) continue;
      read.push_back(arguments[argument.getArgNo()]);
      from.push_back(&argument);
    }
    llvm::Function* result = make_function(read);
    result->splice(result->begin(), draft);
    for (unsigned i = 0; i < from.size(); i++) from[i]->replaceAllUsesWith(result->getArg(i));
    result->takeName(draft);
    draft->eraseFromParent();
    arguments = std::move(read);
    return result;
  }

  void load_values_used_after() {
    Instruction* const end = block_.getTerminator();
    for (Instruction* one : crossing_) {
      llvm::Value* loaded = nullptr;
      for (llvm::Use& use : llvm::make_early_inc_range(one->uses())) {
        if (llvm::cast<Instruction>(use.getUser())->getFunction() != &function_) continue;
        if (!loaded) loaded = load(*one, *end, frame_);
        use.set(loaded);
      }
    }
  }

  llvm::Value* load(const Instruction& value, Instruction& before, llvm::Value* frame) {
    llvm::IRBuilder<> b(&before);
    return b.CreateLoad(value.getType(), slot(b, value, frame), /*isVolatile=*/true);
  }
  void store(Instruction& value, llvm::Value* frame) {
    llvm::IRBuilder<> b(value.getNextNode());
    b.CreateStore(&value, slot(b, value, frame), /*isVolatile=*/true);
  }
  llvm::Value* slot(llvm::IRBuilder<>& b, const Instruction& value, llvm::Value* frame) {
    return b.CreateStructGEP(frame_type_, frame, slots_.lookup(&value));
  }

  llvm::BasicBlock& block_;
  llvm::Function& function_;
  std::vector<Instructions> pieces_;
  llvm::DenseMap<const llvm::Value*, size_t> piece_;
  llvm::DenseMap<const llvm::Value*, unsigned> slots_;
  Instructions crossing_;
  llvm::SetVector<llvm::Value*> elsewhere_;
  llvm::DenseMap<llvm::Value*, llvm::Value*>
      inside_;  // replacements for operands in the current piece
  llvm::StructType* frame_type_ = nullptr;
  llvm::AllocaInst* frame_ = nullptr;
  std::vector<llvm::Function*> new_functions_;
};

}  // namespace

std::vector<llvm::Function*> cut_long_blocks(llvm::Function& function) {
  std::vector<llvm::Function*> pieces;
  for (llvm::BasicBlock& block : function) {
    if (!can_cut(block)) continue;
    for (llvm::Function* piece : BlockCutter(block).cut()) pieces.push_back(piece);
  }
  return pieces;
}

}  // namespace retrograde::codegen
