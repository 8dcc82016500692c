// What the parts of the code generator share: the LLVM function that is being written, the names and
// nodes that have values in it, blocks and branches, and how it is left early.
#pragma once

#include <array>
#include <string>
#include <unordered_map>
#include <vector>

#include "codegen/emitter.h"

namespace retrograde::codegen {

// Memory that loads and stores name.
struct Storage {
  Value* base = nullptr;  // of element 0
  Value* owned =
      nullptr;  // slot of a heap block to free, null once freed; null when not ours to free
  llvm::MDNode* alias = nullptr;  // what else it may overlap: only memory of the same tag
  bool is_private = false;  // a thread's own of a kernel: registers, if its places are constants
};

// Values of nodes, as far as they hold at the insertion point. The handle keeps the node's
// address its own.
struct MemoEntry {
  Expr key;
  Value* value;
};
using Memo = std::unordered_map<const ir::ExprNode*, MemoEntry>;
struct MemoFrame {
  Memo values, indices;  // indices: see Values::index64
  bool sees_outer = false;
  std::unordered_map<std::string, const ir::ExprNode*> lets = {};  // name to bound value
};

// What an index vector is made of: only sums, minima and maxima of ramps; some held by a bound.
struct Coordinate {
  bool is_plain, is_held;
  Expr index;
};
struct LinearIndex {  // lane i is base + i * stride, the base a scalar
  Expr base;
  int64_t stride;
};

// What belongs to one LLVM function: the lowered function itself or the body of a parallel loop.
struct Frame {
  llvm::Function* function = nullptr;
  Value* context = nullptr;
  llvm::BasicBlock* entry = nullptr;       // allocas go here
  llvm::BasicBlock* error_exit = nullptr;  // frees what is owned, returns the code
  llvm::PHINode* error_code = nullptr;
  llvm::AllocaInst* owned_slots = nullptr;  // an array of pointers, as long as the function needs
  int64_t owned_count = 0;
  // What is to be told to the profiler when the function leaves early: a function of the runtime, and
  // where its argument is while that is due, else null.
  struct Farewell {
    std::string function;
    llvm::AllocaInst* argument;
  };
  std::vector<Farewell> farewells;
  int64_t stack_bytes = 0;  // of allocations
  std::array<llvm::AllocaInst*, 2> scratch = {};
  std::vector<MemoFrame> memo;
  std::unordered_map<std::string, Value*> variables;
  std::unordered_map<std::string, Value*>
      indices;  // int32 variables as 64-bit integers, see Values::index64
  std::unordered_map<std::string, Storage> storages;
  std::unordered_map<std::string, Coordinate> coordinates;  // names of plain ones
  std::unordered_map<std::string, LinearIndex> ramps;       // names of vectors that are linear
};

// A region of code whose values end with it. A statement sees no values of the one before (stores
// may have changed what its nodes load); the arm of a branch sees those computed before the
// branch.
class MemoScope {
 public:
  MemoScope(Frame& frame, bool sees_outer) : frame_(frame) {
    frame_.memo.push_back({{}, {}, sees_outer});
  }
  ~MemoScope() { frame_.memo.pop_back(); }

 private:
  Frame& frame_;
};

struct FunctionContext {
  FunctionContext(Emitter& emitter, const std::string& name)
      : e(emitter), b(emitter.b), function_name(name) {}

  Emitter& e;
  llvm::IRBuilder<>& b;
  const std::string& function_name;  // of the lowered one
  Frame frame;

  void begin(llvm::Function* function);
  void finish(Value* code);  // that it returns at the end; null: nothing
  llvm::BasicBlock* new_block(const std::string& name);
  llvm::AllocaInst* entry_alloca(llvm::Type* type, int64_t count, const std::string& name);
  void fail(Value* code);  // leaves the function; the insertion point is a dead end afterwards
  void fail_unless(Value* condition, const std::function<Value*()>& code);
  // Runs `body` only where the scalar condition holds.
  void if_true(Value* condition, const std::function<void()>& body);
  // What `body` gives where the condition holds, elsewhere `otherwise`, or 0.
  Value* value_if(Value* condition, const std::function<Value*()>& body,
                  Value* otherwise = nullptr);
  // One of two values, computed where it is chosen.
  Value* chosen(Value* condition, const std::function<Value*()>& then,
                const std::function<Value*()>& otherwise);

  Storage& storage(const std::string& name);
  Value* string_constant(const std::string& text);
  // Calls a function of the runtime with the context and `args`, and `more` where it is variadic.
  llvm::CallInst* call_runtime(const std::string& name, llvm::Type* result,
                               const std::vector<Value*>& args,
                               const std::vector<Value*>* more = nullptr);
  llvm::Constant* null_pointer() { return llvm::ConstantPointerNull::get(b.getPtrTy()); }
  llvm::ConstantInt* int64(int64_t number) { return b.getInt64(static_cast<uint64_t>(number)); }

 private:
  std::unordered_map<std::string, Value*> strings_;
};

// What memory of the name may overlap.
llvm::MDNode* alias_tag(Emitter& e, const std::string& name);

}  // namespace retrograde::codegen
