// From the statements and expressions of one lowered function to LLVM IR.
//
//   expressions.cpp   every expression kind; each shared node once
//   calls.cpp         operators that need more than their arguments' values
//   access.cpp        loads and stores: which vectors of addresses are dense, strided, or neither
//   statements.cpp    loops, branches, allocations, assertions
//   parallel.cpp      bodies of parallel loops as functions of their own
//   fork.cpp          statements that run at the same time
//   atomics.cpp       updates of one element from several iterations at once
//   runtime_calls.cpp what lowering asks of the runtime
//   messages.cpp      errors and prints
//   buffers.cpp       halide_buffer_t
#pragma once

#include <array>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "codegen/emitter.h"
#include "ir/lowered_function.h"

namespace retrograde::codegen {

class FunctionGenerator {
 public:
  FunctionGenerator(Emitter& emitter, const ir::LoweredFunction& function);
  // Adds `name` and `name_argv` to the module.
  void generate();

 private:
  // Memory that loads and stores name.
  struct Storage {
    Value* base = nullptr;  // of element 0
    Value* owned =
        nullptr;  // slot of a heap block to free, null once freed; null when not ours to free
    llvm::MDNode* alias = nullptr;  // what else it may overlap: only memory of the same tag
  };

  // Values of nodes, as far as they hold at the insertion point. The handle keeps the node's
  // address its own.
  struct MemoEntry {
    Expr key;
    Value* value;
  };
  using Memo = std::unordered_map<const ir::ExprNode*, MemoEntry>;
  struct MemoFrame {
    Memo values, indices;  // indices: see index64
    bool sees_outer = false;
    std::unordered_map<std::string, const ir::ExprNode*> lets = {};  // name to bound value
  };
  // A region of code whose values end with it. A statement sees no values of the one before (stores
  // may have changed what its nodes load); the arm of a branch sees those computed before the
  // branch.
  class MemoScope {
   public:
    MemoScope(FunctionGenerator& generator, bool sees_outer) : generator_(generator) {
      generator_.frame_.memo.push_back({{}, {}, sees_outer});
    }
    ~MemoScope() { generator_.frame_.memo.pop_back(); }

   private:
    FunctionGenerator& generator_;
  };

  // What an index vector is made of: only sums, minima and maxima of ramps; some held by a bound.
  struct Coordinate {
    bool is_plain, is_held;
    Expr index;
  };
  static constexpr int most_coordinate_nodes = 64;  // larger ones are looked at as a whole

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
    llvm::AllocaInst* profiler_slot = nullptr;  // a run to end when the function leaves early
    int64_t stack_bytes = 0;                    // of allocations
    std::array<llvm::AllocaInst*, 2> scratch = {};
    std::vector<MemoFrame> memo;
    std::unordered_map<std::string, Value*> variables;
    std::unordered_map<std::string, Value*>
        indices;  // int32 variables as 64-bit integers, see index64
    std::unordered_map<std::string, Storage> storages;
    std::unordered_map<std::string, Coordinate> coordinates;  // names of plain ones
    std::unordered_map<std::string, LinearIndex> ramps;       // names of vectors that are linear
  };

  // statements.cpp
  void begin_function(llvm::Function* function);
  void finish_function();
  void fail(Value* code);  // leaves the function; the insertion point is a dead end afterwards
  void fail_unless(Value* condition, const std::function<Value*()>& code);
  llvm::AllocaInst* entry_alloca(llvm::Type* type, int64_t count, const std::string& name);
  llvm::BasicBlock* new_block(const std::string& name);
  void statement(const Stmt& s);
  void make(const ir::LetStmt& s);
  void make(const ir::Assert& s);
  void make(const ir::For& s);
  void make(const ir::Allocate& s);
  void make(const ir::Free& s);
  void make(const ir::IfThenElse& s);
  void serial_loop(const ir::For& s);
  bool fits_stack(const ir::Allocate& s, int64_t elements) const;
  Storage allocate_on_stack(const ir::Allocate& s, int64_t elements);
  Storage allocate_on_heap(const ir::Allocate& s);
  Value* new_owned_slot();
  void free_owned(Storage& storage);
  void bind_arguments();
  void make_argv_wrapper(llvm::Function* function);
  llvm::MDNode* alias_tag(const std::string& name);

  // parallel.cpp
  struct Task {
    llvm::Function* function;
    Value* closure;
  };
  // The statement as a function; `index` names its number, when it has one.
  Task outline(const Stmt& body, const std::string& name, const std::string& index = "",
               Type index_type = Int(32));
  void parallel_loop(const ir::For& s);

  // fork.cpp
  void make(const ir::Fork& s);

  // atomics.cpp
  void make(const ir::Atomic& s);
  void atomic_store(const ir::Store& s);
  struct AtomicLane {  // one element, and what its update needs
    llvm::AtomicRMWInst::BinOp op;
    Value *pointer, *operand;
  };
  void atomic_instruction(const AtomicLane& lane, const Storage& storage);
  void compare_and_swap(Type type, Value* pointer, const Storage& storage,
                        const std::function<Value*(Value*)>& updated);
  void compare_and_swap(const ir::Store& s);
  void locked(const ir::Atomic& s, const ir::Store& first);

  // runtime_calls.cpp
  Value* runtime_call(const ir::Call& e);
  Value* pack(const std::vector<Expr>& parts);
  Value* prefetch(const ir::Call& e);
  Value* trace(const ir::Call& e);

  // expressions.cpp
  Value* value(const Expr& e);
  Value* value_alone(const Expr& e);  // in a scope of its own
  // Null: the node has none yet.
  Value* known(Memo MemoFrame::*memo, const Expr& e) const;
  // Of a node that has one already, or what `make` gives.
  Value* remembered(Memo MemoFrame::*memo, const Expr& e,
                    Value* (FunctionGenerator::*make)(const Expr&));
  // A scalar index as a 64-bit integer, computed in 64 bits as far as it is made of + - *: modulo
  // 2^32 that is its int32 value, and an index that fits int32 is exactly it. Addresses then need
  // no sign extension that hides their structure from LLVM, and large buffers work.
  Value* index64(const Expr& e);
  Value* make_index64(const Expr& e);
  void bind_let(const std::string& name, const Expr& value);
  void bind_ramp(const std::string& name, const Expr& bound);
  bool rebinds(const std::string& name, const Expr& value) const;
  Value* make(const ir::Let& e);
  Value* make(const ir::Variable& e);
  Value* make(const ir::Ramp& e);
  Value* make(const ir::Shuffle& e);
  Value* make(const ir::VectorReduce& e);
  Value* make_immediate(const Expr& e);
  Value* make_value(const Expr& e);
  Value* string_constant(const std::string& text);

  // calls.cpp
  Value* make(const ir::Call& e);
  Value* operator_call(const ir::Call& e);
  Value* extern_call(const ir::Call& e);
  Value* branch_value(const Expr& condition, const Expr& then_value, const Expr& else_value);
  Value* require(const ir::Call& e);
  Value* random(const ir::Call& e);

  // narrow_products.cpp
  Value* reduced_in_part(const ir::VectorReduce& e);
  Value* sum_of_products(const Expr& e);

  // costly_arms.cpp
  bool is_costly(const Expr& arm) const;
  Value* value_where(Value* wanted, const Expr& arm, Value* otherwise);
  Value* make(const ir::Select& e);

  // strong_products.cpp
  Value* sum_with_strong_product(const ir::Binary& e);

  // held_loads.cpp
  std::optional<bool> climbs(const Expr& e, int& room) const;
  Value* at_lane(const Expr& e, Value* lane);
  Expr climbing_part(const Expr& e) const;
  Value* load_held(const Storage& from, Type type, const Expr& index, Value* predicate);
  Value* load_spread(const Storage& from, Type type, const Expr& index, int start,
                     Value* predicate);
  struct Ends {
    Value *first, *last;
  };
  Ends ends_of(Value* predicate, int lanes);
  Value* load_dense_or_gather(const Storage& from, Type type, const Expr& index, Value* predicate);

  // access.cpp
  std::optional<LinearIndex> as_linear(const Expr& index);
  Storage& storage(const std::string& name);
  Value* index_vector(const Expr& index);
  Value* element_pointer(const Storage& from, Type type, Value* index);
  Value* make(const ir::Load& e);
  Value* load_scalar(const Storage& from, Type type, Value* index, Value* predicate);
  Value* load_vector(const Storage& from, Type type, const Expr& index, Value* predicate);
  Value* load_linear(const Storage& from, Type type, const LinearIndex& index, Value* predicate);
  Value* load_dense(const Storage& from, Type type, Value* first, Value* predicate);
  Value* load_strided(const Storage& from, Type type, Value* first, int64_t stride);
  Value* lane_index(Value* first, Value* stride, int lane);
  Value* load_apart(const Storage& from, Type type, Value* first, Value* stride);
  Value* gather(const Storage& from, Type type, Value* indices, Value* predicate);
  Value* where_any(Type type, Value* indices, Value* predicate,
                   const std::function<Value*(Value* safe)>& load);
  Value* gather_filled_up(const Storage& from, Type type, Value* indices, Value* mask);
  Coordinate coordinate(const Expr& index) const;
  Value* gather_in_loop(const Storage& from, Type type, Value* indices);
  Value* gather_compactly(const Storage& from, Type type, Value* indices, Value* predicate);
  Value* scratch(size_t slot, llvm::Type* type);
  void make(const ir::Store& s);
  void store_scalar(const Storage& to, Type type, Value* index, Value* value, Value* predicate);
  void store_vector(const Storage& to, Type type, const Expr& index, Value* value,
                    Value* predicate);
  void store_dense(const Storage& to, Type type, Value* first, Value* value, Value* predicate);
  void scatter(const Storage& to, Type type, Value* indices, Value* value, Value* predicate);
  Value* predicate_value(const Expr& predicate);  // null when always true
  Value* from_memory(Type type, Value* value);
  Value* to_memory(Type type, Value* value);
  template <class Instruction>
  Instruction* tagged(Instruction* instruction, const Storage& storage) {
    if (storage.alias) instruction->setMetadata(llvm::LLVMContext::MD_tbaa, storage.alias);
    return instruction;
  }

  // messages.cpp
  // `separator` stands between parts. `lane`: which lane of vectors to show.
  Value* report_error(Value* code, const std::vector<Expr>& parts, size_t first,
                      const std::string& separator);
  void print(const std::vector<Expr>& parts, size_t first, int lane);
  Value* print_call(const ir::Call& e);
  struct Format {
    std::string text;
    std::vector<Value*> args;
  };
  void add_part(Format& format, const Expr& part, int lane, bool printed);

  // buffers.cpp
  bool is_buffer_operator(ir::Op op) const;
  Value* buffer_operator(const ir::Call& e);
  Value* host_pointer(Value* buffer);
  Value* buffer_field(Value* buffer, llvm::Type* type, int64_t offset);
  Value* dimension_pointer(Value* buffer, Value* dimension, int64_t offset);

  // Calls a function of the runtime with the context and `args`, and `more` where it is variadic.
  llvm::CallInst* call_runtime(const std::string& name, llvm::Type* result,
                               const std::vector<Value*>& args,
                               const std::vector<Value*>* more = nullptr);
  llvm::Constant* null_pointer() { return llvm::ConstantPointerNull::get(b_.getPtrTy()); }
  llvm::ConstantInt* int64(int64_t number) { return b_.getInt64(static_cast<uint64_t>(number)); }

  // Runs `body` only where the scalar condition holds.
  void if_true(Value* condition, const std::function<void()>& body);
  // What `body` gives where the condition holds, 0 elsewhere.
  Value* value_if(Value* condition, const std::function<Value*()>& body);
  // One of two values, computed where it is chosen.
  Value* chosen(Value* condition, const std::function<Value*()>& then,
                const std::function<Value*()>& otherwise);

  Emitter& e_;
  llvm::IRBuilder<>& b_;
  const ir::LoweredFunction& source_;
  Frame frame_;
  std::unordered_map<std::string, Value*> strings_;
  int parallel_loops_ = 0;
};

}  // namespace retrograde::codegen
