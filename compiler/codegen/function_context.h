// State that the parts of the code generator share while they emit one LLVM function: values of names and nodes,
// blocks, branches and early exits.
#pragma once

#include <array>
#include <string>
#include <unordered_map>
#include <vector>

#include "codegen/emitter.h"

namespace retrograde::codegen {

// Memory that loads and stores refer to by name.
struct Storage {
  Value* base = nullptr;  // address of element 0
  Value* owned =
      nullptr;  // slot of a heap block to free, null once freed; null when not ours to free
  llvm::MDNode* alias = nullptr;  // alias tag: only memory with the same tag may overlap
  bool is_private =
      false;  // private to a kernel's thread; kept in registers if all its indices are constant
};

// Values of nodes that are valid at the insertion point. Keeping the handle prevents another node from reusing the
// node's address.
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

// The form of an index vector. Plain: only sums, minima and maxima of ramps. Held: some of them are clamped to a bound.
struct Coordinate {
  bool is_plain, is_clamped;
  Expr index;
};
struct LinearIndex {  // lane i is base + i * stride, the base a scalar
  Expr base;
  int64_t stride;
};

// State of one LLVM function: the lowered function itself, or the body of a parallel loop.
struct Frame {
  llvm::Function* function = nullptr;
  Value* context = nullptr;
  llvm::BasicBlock* entry = nullptr;       // allocas go here
  llvm::BasicBlock* error_exit = nullptr;  // frees owned blocks, returns the code
  llvm::PHINode* error_code = nullptr;
  llvm::AllocaInst* owned_slots =
      nullptr;  // an array of pointers, one per owned block of the function
  int64_t owned_count = 0;
  // A runtime function to call if the function exits early, so that the profiler learns of it. `argument` holds the
  // call's argument while the call is due, else null.
  struct ExitCall {
    std::string function;
    llvm::AllocaInst* argument;
  };
  std::vector<ExitCall> exit_calls;
  int64_t stack_bytes = 0;  // used by allocations
  std::array<llvm::AllocaInst*, 2> scratch = {};
  std::vector<MemoFrame> memo;
  std::unordered_map<std::string, Value*> variables;
  std::unordered_map<std::string, Value*>
      indices;  // int32 variables as 64-bit integers, see Values::index64
  std::unordered_map<std::string, Storage> storages;
  // Texts that messages about heap blocks show, where a closure passes them; else the names themselves.
  std::unordered_map<std::string, Value*> block_names;
  std::unordered_map<std::string, Coordinate> coordinates;  // plain coordinates, by name
  std::unordered_map<std::string, LinearIndex> ramps;       // linear vectors, by name
};

// A region of code whose values are forgotten at its end. A statement sees no values of earlier statements, because
// stores may have changed what its nodes load. The arm of a branch sees the values computed before the branch.
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
  const std::string& function_name;  // name of the lowered function
  Frame frame;

  void begin(llvm::Function* function);
  void finish(Value* code);  // the return value; null: the function returns nothing
  llvm::BasicBlock* new_block(const std::string& name);
  llvm::AllocaInst* entry_alloca(llvm::Type* type, int64_t count, const std::string& name);
  void fail(Value* code);  // leaves the function; the insertion point is a dead end afterwards
  void fail_unless(Value* condition, const std::function<Value*()>& code);
  // Runs `body` only if the scalar condition holds.
  void if_true(Value* condition, const std::function<void()>& body);
  // The value of `body` if the condition holds; otherwise `otherwise`, or 0.
  Value* value_if(Value* condition, const std::function<Value*()>& body,
                  Value* otherwise = nullptr);
  // Evaluates only the alternative that the condition selects.
  Value* chosen(Value* condition, const std::function<Value*()>& then,
                const std::function<Value*()>& otherwise);

  Storage& storage(const std::string& name);
  Value* block_name(const std::string& name);  // what messages call a heap block
  Value* string_constant(const std::string& text);
  // Calls a function of the runtime with the context and `args`; `more` are its variadic arguments.
  llvm::CallInst* call_runtime(const std::string& name, llvm::Type* result,
                               const std::vector<Value*>& args,
                               const std::vector<Value*>* more = nullptr);
  llvm::Constant* null_pointer() { return llvm::ConstantPointerNull::get(b.getPtrTy()); }
  llvm::ConstantInt* int64(int64_t number) { return b.getInt64(static_cast<uint64_t>(number)); }

 private:
  std::unordered_map<std::string, Value*> strings_;
};

// The alias tag of the memory with this name.
llvm::MDNode* alias_tag(Emitter& e, const std::string& name);

}  // namespace retrograde::codegen
