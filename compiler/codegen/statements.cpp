// Code for functions, loops, branches, allocations and assertions.
#include <llvm/IR/InlineAsm.h>
#include <llvm/IR/MDBuilder.h>

#include <set>

#include "codegen/cpu/long_functions.h"
#include "codegen/function_generator.h"
#include "codegen/memory/access.h"
#include "codegen/values/calls.h"
#include "diagnostics/error.h"
#include "ir/build.h"
#include "ir/print.h"
#include "ir/visit.h"

namespace retrograde::codegen {

using namespace ir;

namespace {
// Threads of the pool have stacks of a few MB, and a waiting iteration may run another one on top of its stack.
struct StackLimit {
  int64_t block_bytes, function_bytes;
};
constexpr StackLimit free_choice{16 << 10, 128 << 10};  // allocations with MemoryType::Auto
constexpr StackLimit asked_for{256 << 10, 512 << 10};   // allocations with MemoryType::Stack
}  // namespace

FunctionGenerator::FunctionGenerator(Emitter& emitter, const LoweredFunction& function,
                                     DeviceTarget* device)
    : e_(emitter),
      b_(emitter.b),
      source_(function),
      device_(device),
      kernels_(emitter, function),
      c_(emitter, function.name) {}

// ---- functions ----

void FunctionGenerator::bind_arguments() {
  unsigned index = 1;
  for (const LoweredArgument& arg : source_.args) {
    Value* v = c_.frame.function->getArg(index++);
    v->setName(arg.name);
    if (arg.is_buffer()) {
      c_.frame.variables[arg.name + ".buffer"] = v;
      c_.frame.storages[arg.name] = {host_pointer(c_, v), nullptr, alias_tag(e_, arg.name)};
    } else {
      c_.frame.variables[arg.name] = v;
    }
  }
}

void FunctionGenerator::generate() {
  std::vector<llvm::Type*> params = {b_.getPtrTy()};
  for (const LoweredArgument& arg : source_.args) {
    params.push_back(arg.is_buffer() ? b_.getPtrTy() : llvm_type(e_, arg.type));
  }
  auto* type = llvm::FunctionType::get(b_.getInt32Ty(), params, false);
  auto* function =
      llvm::Function::Create(type, llvm::GlobalValue::ExternalLinkage, source_.name, e_.module);
  // Access checks prevent LLVM from fusing products and sums in one copy of a definition but not in another. Threads
  // that compute the same element would then differ in the last bits.
  const bool contracts = !e_.machine.target.has_feature(Target::StrictFloat) &&
                         !e_.machine.target.has_feature(Target::CheckedAccesses);
  const Contraction contraction(e_, contracts);
  c_.begin(function);
  bind_arguments();
  is_long_ = is_long(source_.body);
  if (source_.body.defined()) statement(source_.body);
  c_.finish(b_.getInt32(0));
  make_argv_wrapper(function);
  kernels_.finish();
}

// args[i] is the buffer, or a pointer to the scalar.
void FunctionGenerator::make_argv_wrapper(llvm::Function* function) {
  auto* type = llvm::FunctionType::get(b_.getInt32Ty(), {b_.getPtrTy(), b_.getPtrTy()}, false);
  auto* wrapper = llvm::Function::Create(type, llvm::GlobalValue::ExternalLinkage,
                                         source_.name + "_argv", e_.module);
  c_.frame = {};
  c_.begin(wrapper);
  std::vector<Value*> args = {wrapper->getArg(0)};
  for (size_t i = 0; i < source_.args.size(); i++) {
    const LoweredArgument& arg = source_.args[i];
    Value* pointer =
        b_.CreateLoad(b_.getPtrTy(), b_.CreateConstGEP1_64(b_.getPtrTy(), wrapper->getArg(1), i));
    if (!arg.is_buffer())
      pointer = from_memory(e_, arg.type, b_.CreateLoad(memory_type(e_, arg.type), pointer));
    args.push_back(pointer);
  }
  c_.finish(b_.CreateCall(function, args));
}

void FunctionGenerator::make(const Assert& s) {
  if (is_undef(s.error)) return;  // proved to hold
  const MemoScope scope(c_.frame, false);
  Value* condition = values_.of(s.condition);
  c_.fail_unless(condition, [&] { return values_.of(s.error); });
}

// Code for values that are not numbers rarely runs: registers are for the code around it.
static bool is_unlikely(const Expr& condition) {
  return ir::any_node(condition, [](const Expr& e) { return as_op(e, Op::is_nan) != nullptr; });
}

// Arrays on the stack that unlikely code reads stay in memory. In registers, they would take those of the loops before it.
// Threads of a device have their stack in slow memory, and more registers.
void FunctionGenerator::keep_in_memory(const Stmt& read_by) {
  if (c_.e.machine.is_device()) return;
  std::set<std::string> read, written;
  walk(
      read_by, [&](const ir::Load& load) { read.insert(load.name); },
      [&](const ir::Store& store) { written.insert(store.name); });
  for (const std::string& name : read) {
    const auto found = c_.frame.storages.find(name);
    if (written.contains(name) || found == c_.frame.storages.end()) continue;
    Value* array = found->second.base;
    if (!llvm::isa<llvm::AllocaInst>(array->stripPointerCasts())) continue;
    auto* type = llvm::FunctionType::get(b_.getVoidTy(), {array->getType()}, false);
    b_.CreateCall(llvm::InlineAsm::get(type, "", "r,~{memory}", true), {array});
  }
}

void FunctionGenerator::make(const IfThenElse& s) {
  Value* condition = values_.alone(s.condition);
  llvm::BasicBlock *then_block = c_.new_block("then"), *after = c_.new_block("after");
  llvm::BasicBlock* else_block = s.when_false.defined() ? c_.new_block("else") : after;
  const bool unlikely = is_unlikely(s.condition);
  llvm::MDBuilder weights(c_.e.context());
  b_.CreateCondBr(condition, then_block, else_block,
                  unlikely ? weights.createUnlikelyBranchWeights() : nullptr);
  b_.SetInsertPoint(then_block);
  if (unlikely) keep_in_memory(s.when_true);
  statement(s.when_true);
  b_.CreateBr(after);
  if (s.when_false.defined()) {
    b_.SetInsertPoint(else_block);
    statement(s.when_false);
    b_.CreateBr(after);
  }
  b_.SetInsertPoint(after);
}

// ---- statements ----

void FunctionGenerator::statement(const Stmt& s) {
  enter_site(s);
  match(
      s, [&](const LetStmt& let) { make(let); }, [&](const Assert& a) { make(a); },
      [&](const ProducerConsumer& p) { statement(p.body); }, [&](const For& f) { make(f); },
      [&](const Store& to) { store(values_, to); }, [&](const Allocate& a) { make(a); },
      [&](const Free& f) { free_owned(c_.storage(f.name)); },
      [&](const Block& block) {
        for (const Stmt& part : block.stmts) statement(part);
      },
      [&](const IfThenElse& branch) { make(branch); }, [&](const Fork& f) { make(f); },
      [&](const Atomic& a) { make(a); }, [&](const Launch& l) { make(l); },
      [&](const Evaluate& e) {
        if (as_op(e.value, Op::gpu_barrier) || as_op(e.value, Op::gpu_warp_barrier))
          return barrier(e);
        values_.alone(e.value);
      },
      [&](const StmtNode& node) {
        throw InternalError(
            text(kind_name(node.kind), " reached code generation: lowering replaces it"), "codegen",
            ir::print(s));
      });
}

void FunctionGenerator::make(const LetStmt& s) {
  // No recursion along a chain of lets: bounds computations make long ones.
  const LetStmt* let = &s;
  for (;;) {
    {
      const MemoScope scope(c_.frame, false);
      values_.bind(let->name, let->value);
    }
    const auto* next = let->body.as<LetStmt>();
    if (!next) break;
    let = next;
  }
  statement(let->body);
}

void FunctionGenerator::make(const For& s) {
  switch (s.runs) {
    case ForType::Serial:
      return is_worth_a_function(s) ? called_loop(s) : serial_loop(s);
    case ForType::Parallel:
      return parallel_loop(s);
    default:
      throw InternalError(
          "a vectorized or unrolled loop over " + quoted(s.name) + " reached code generation",
          "codegen", ir::print(Stmt(&s)));
  }
}

// Counts in 64 bits, in which nothing overflows; the body sees the variable in its own width.
void FunctionGenerator::serial_loop(const For& s) {
  Value *min, *extent;
  {
    const MemoScope scope(c_.frame, false);
    min = values_.index64(s.min);
    extent = b_.CreateSExt(values_.of(s.extent), b_.getInt64Ty());
  }
  Value* end = b_.CreateNSWAdd(min, extent);
  llvm::BasicBlock *before = b_.GetInsertBlock(), *body = c_.new_block(s.name),
                   *after = c_.new_block("end " + s.name);
  b_.CreateCondBr(b_.CreateICmpSGT(extent, b_.getInt64(0)), body, after);
  b_.SetInsertPoint(body);
  llvm::PHINode* counter = b_.CreatePHI(b_.getInt64Ty(), 2, s.name);
  counter->addIncoming(min, before);
  c_.frame.variables[s.name] = b_.CreateTrunc(counter, llvm_type(e_, s.min.type()));
  if (s.min.type() == Int(32)) c_.frame.indices[s.name] = counter;
  ++loops_around_;
  statement(s.body);
  --loops_around_;
  Value* next = b_.CreateNSWAdd(counter, b_.getInt64(1));
  counter->addIncoming(next, b_.GetInsertBlock());
  b_.CreateCondBr(b_.CreateICmpSLT(next, end), body, after);
  b_.SetInsertPoint(after);
  c_.frame.indices.erase(s.name);
}

// ---- allocations ----

bool FunctionGenerator::fits_stack(const Allocate& s, int64_t elements) const {
  if (s.memory == MemoryType::Heap || elements < 0) return false;
  const StackLimit& limit = s.memory == MemoryType::Stack ? asked_for : free_choice;
  const int64_t element_bytes = s.type.bytes() * s.type.lanes();
  if (elements > limit.block_bytes / element_bytes) return false;
  return c_.frame.stack_bytes + elements * element_bytes <= limit.function_bytes;
}

Storage FunctionGenerator::allocate_on_stack(const Allocate& s, int64_t elements) {
  const int64_t bytes = elements * s.type.bytes() * s.type.lanes();
  c_.frame.stack_bytes += bytes;
  llvm::AllocaInst* block = c_.entry_alloca(b_.getInt8Ty(), bytes, s.name);
  block->setAlignment(llvm::Align(64));
  b_.CreateLifetimeStart(block, c_.int64(bytes));
  return {block, nullptr, alias_tag(e_, s.name)};
}

Storage FunctionGenerator::allocate_on_heap(const Allocate& s) {
  Value* elements =
      b_.CreateIntCast(values_.alone(s.elements), b_.getInt64Ty(), s.elements.type().is_int());
  Value* element_bytes = c_.int64(int64_t{s.type.bytes()} * s.type.lanes());
  llvm::CallInst* block =
      c_.call_runtime("retrograde_allocate", b_.getPtrTy(), {elements, element_bytes});
  block->setName(s.name);
  block->getCalledFunction()->setReturnDoesNotAlias();
  c_.fail_unless(b_.CreateICmpNE(block, c_.null_pointer()), [&] {
    return c_.call_runtime("retrograde_allocation_error", b_.getInt32Ty(),
                           {c_.block_name(s.name), elements, element_bytes});
  });
  if (!c_.frame.owned_slots) c_.frame.owned_slots = c_.entry_alloca(b_.getPtrTy(), 1, "owned");
  Value* slot = b_.CreateConstGEP1_64(b_.getPtrTy(), c_.frame.owned_slots,
                                      static_cast<uint64_t>(c_.frame.owned_count++));
  b_.CreateStore(block, slot);
  return {block, slot, alias_tag(e_, s.name)};
}

void FunctionGenerator::free_owned(Storage& owned) {
  if (!owned.owned) return;
  c_.call_runtime("retrograde_free", b_.getVoidTy(), {b_.CreateLoad(b_.getPtrTy(), owned.owned)});
  b_.CreateStore(c_.null_pointer(), owned.owned);
}

void FunctionGenerator::make(const Allocate& s) {
  if (device_) {
    c_.frame.storages[s.name] = allocate_in_kernel(s);
    return statement(s.body);
  }
  const auto elements = as_const_int(s.elements);
  const bool on_stack = elements && fits_stack(s, *elements);
  c_.frame.storages[s.name] = on_stack ? allocate_on_stack(s, *elements) : allocate_on_heap(s);
  statement(s.body);
  free_owned(
      c_.frame.storages[s.name]);  // after a Free the slot is null, and freeing null does nothing
  c_.frame.storages.erase(s.name);
}

}  // namespace retrograde::codegen
