// Generates LLVM IR from the statements of one lowered function.
//
//   function_context.h  the LLVM function being emitted: names, branches, early exits
//   values.h            expressions; each shared node is evaluated once
//   access.h            loads and stores: whether index vectors are dense, strided or arbitrary
//   kernels.h           GPU kernels, generated from the same statements
//   calls.h             operators that need more than the values of their arguments; runtime calls
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "codegen/device/kernels.h"
#include "codegen/values/values.h"
#include "ir/lowered_function.h"

namespace retrograde::codegen {

class FunctionGenerator {
 public:
  // `device`: set to generate kernels only.
  FunctionGenerator(Emitter& emitter, const ir::LoweredFunction& function,
                    DeviceTarget* device = nullptr);
  // Adds `name` and `name_argv` to the module.
  void generate();
  llvm::Function* generate_kernel(KernelUse& kernel);
  // The function's kernels, once generate() has run.
  const KernelSet& kernels() const { return kernels_; }

 private:
  // statements.cpp: loops, branches, allocations, assertions
  void bind_arguments();
  void make_argv_wrapper(llvm::Function* function);
  void statement(const Stmt& s);
  void make(const ir::LetStmt& s);
  void make(const ir::Assert& s);
  void make(const ir::For& s);
  void make(const ir::Allocate& s);
  void make(const ir::IfThenElse& s);
  void keep_in_memory(const Stmt& read_by);
  void serial_loop(const ir::For& s);
  bool fits_stack(const ir::Allocate& s, int64_t elements) const;
  Storage allocate_on_stack(const ir::Allocate& s, int64_t elements);
  Storage allocate_on_heap(const ir::Allocate& s);
  void free_owned(Storage& storage);

  // outline.cpp: statements as separate functions
  struct Task {
    llvm::Function* function;
    Value* closure;
  };
  // The names that a statement uses from outside, in the order of the closure's fields.
  struct Captures {
    std::vector<std::string> variables, storages, blocks;
  };
  // A statement that has a function. `index` names its iteration number, if it has one.
  struct Outlined {
    Stmt body;
    std::string index;
    Captures captures;
    std::vector<size_t> aliases;  // of the storages
    llvm::StructType* closure;
    llvm::Function* function;
  };
  // Emits the statement as a function; one that is equal up to names to an earlier one shares its function. `index`
  // names the variable that holds the iteration number, if any. `what` becomes part of the function's name.
  Task outline(const Stmt& body, const std::string& what, const std::string& name,
               const std::string& index = "", Type index_type = Int(32));
  Captures captures_of(const Stmt& body, const std::string& index) const;
  std::optional<std::vector<Value*>> values_of(const Captures& captures);
  std::vector<size_t> aliases_of(const Captures& captures) const;
  Value* make_closure(llvm::StructType* type, const std::vector<Value*>& values,
                      const std::string& name);
  std::optional<Task> shared_task(const Stmt& body, const std::string& index,
                                  const std::string& name);
  void emit_task(const Outlined& task, Type index_type);

  // parallel.cpp: parallel loops
  void parallel_loop(const ir::For& s);

  // long_functions.cpp: outermost loops as separate functions
  bool is_worth_a_function(const ir::For& s) const;
  void called_loop(const ir::For& s);

  // fork.cpp: statements that run in parallel
  void make(const ir::Fork& s);

  // atomics.cpp: atomic updates
  void make(const ir::Atomic& s);
  void locked(const ir::Atomic& s, const ir::Store& first);

  // launch.cpp: kernel launches, on the host's side
  void make(const ir::Launch& s);
  void run(const KernelUse& kernel, const std::vector<Value*>& blocks, Value* shared_bytes);
  void check_call(const std::string& function, const std::vector<Value*>& args);
  Value* buffer_behind(const std::string& storage);
  llvm::Constant* constant_table(llvm::Type* type, const std::vector<llvm::Constant*>& entries);

  // kernel_body.cpp
  unsigned site_metadata();
  void enter_site(const Stmt& s);
  void barrier(const ir::Evaluate& s);
  Storage allocate_in_kernel(const ir::Allocate& s);

  Emitter& e_;
  llvm::IRBuilder<>& b_;
  const ir::LoweredFunction& source_;
  DeviceTarget* const device_;  // null unless this generates kernels
  KernelUse* kernel_ = nullptr;
  KernelSet kernels_;
  FunctionContext c_;
  Values values_{c_};
  std::vector<Outlined> outlined_;
  bool is_long_ = false;
  int loops_around_ = 0;
};

}  // namespace retrograde::codegen
