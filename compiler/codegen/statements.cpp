// Functions, loops, branches, allocations, assertions.
//
// Leaving early: every failure jumps to one block of its function, which frees the heap blocks that
// are still held and returns the code. Each Allocate keeps its block in a slot of an array on the
// stack, null before and after. The array is memory for good, because the runtime gets its address:
// in registers, n slots that are alive at n failures would be n^2 copies.
#include <llvm/IR/MDBuilder.h>

#include "codegen/function_generator.h"
#include "diagnostics/error.h"
#include "ir/build.h"
#include "ir/print.h"
#include "ir/visit.h"

namespace retrograde::codegen {

using namespace ir;

namespace {
// Threads of the pool have stacks of a few MB, and an iteration may wait on top of another.
struct StackLimit {
  int64_t block_bytes, function_bytes;
};
constexpr StackLimit free_choice{16 << 10, 128 << 10};  // of allocations that may go anywhere
constexpr StackLimit asked_for{256 << 10, 512 << 10};   // of those that ask for the stack
constexpr int64_t stack_padding_bytes = 64;             // readable past the end, as on the heap
}  // namespace

FunctionGenerator::FunctionGenerator(Emitter& emitter, const LoweredFunction& function)
    : e_(emitter), b_(emitter.b), source_(function) {}

// ---- functions ----

void FunctionGenerator::begin_function(llvm::Function* function) {
  set_target(e_, function);
  frame_.function = function;
  frame_.context = function->getArg(0);
  frame_.context->setName("context");
  frame_.entry = llvm::BasicBlock::Create(e_.context(), "entry", function);
  llvm::BasicBlock* body = new_block("body");
  b_.SetInsertPoint(body);
}

void FunctionGenerator::finish_function() {
  b_.CreateRet(b_.getInt32(0));
  Value* count = int64(frame_.owned_count);
  if (frame_.error_exit) {
    b_.SetInsertPoint(frame_.error_exit);
    if (frame_.profiler_slot)
      call_runtime("retrograde_profiler_end", b_.getInt32Ty(),
                   {b_.CreateLoad(b_.getPtrTy(), frame_.profiler_slot)});
    if (frame_.owned_slots)
      call_runtime("retrograde_free_all", b_.getVoidTy(), {frame_.owned_slots, count});
    b_.CreateRet(frame_.error_code);
  }
  b_.SetInsertPoint(frame_.entry);
  if (frame_.owned_slots) {
    frame_.owned_slots->setOperand(0, count);
    b_.CreateMemSet(frame_.owned_slots, b_.getInt8(0),
                    static_cast<uint64_t>(8 * frame_.owned_count), llvm::Align(8));
  }
  if (frame_.profiler_slot) b_.CreateStore(null_pointer(), frame_.profiler_slot);
  b_.CreateBr(&*std::next(frame_.function->begin()));
}

void FunctionGenerator::bind_arguments() {
  unsigned index = 1;
  for (const LoweredArgument& arg : source_.args) {
    Value* v = frame_.function->getArg(index++);
    v->setName(arg.name);
    if (arg.is_buffer()) {
      frame_.variables[arg.name + ".buffer"] = v;
      frame_.storages[arg.name] = {host_pointer(v), nullptr, alias_tag(arg.name)};
    } else {
      frame_.variables[arg.name] = v;
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
  const Contraction contraction(e_, !e_.machine.target.has_feature(Target::StrictFloat));
  begin_function(function);
  frame_.memo.push_back({{}, {}, false});
  bind_arguments();
  if (source_.body.defined()) statement(source_.body);
  finish_function();
  make_argv_wrapper(function);
}

// args[i] is the buffer, or points to the scalar.
void FunctionGenerator::make_argv_wrapper(llvm::Function* function) {
  auto* type = llvm::FunctionType::get(b_.getInt32Ty(), {b_.getPtrTy(), b_.getPtrTy()}, false);
  auto* wrapper = llvm::Function::Create(type, llvm::GlobalValue::ExternalLinkage,
                                         source_.name + "_argv", e_.module);
  frame_ = {};
  begin_function(wrapper);
  std::vector<Value*> args = {wrapper->getArg(0)};
  for (size_t i = 0; i < source_.args.size(); i++) {
    const LoweredArgument& arg = source_.args[i];
    Value* pointer =
        b_.CreateLoad(b_.getPtrTy(), b_.CreateConstGEP1_64(b_.getPtrTy(), wrapper->getArg(1), i));
    if (!arg.is_buffer())
      pointer = from_memory(arg.type, b_.CreateLoad(memory_type(e_, arg.type), pointer));
    args.push_back(pointer);
  }
  b_.CreateRet(b_.CreateCall(function, args));
  b_.SetInsertPoint(frame_.entry);
  b_.CreateBr(&*std::next(wrapper->begin()));
}

llvm::CallInst* FunctionGenerator::call_runtime(const std::string& name, llvm::Type* result,
                                                const std::vector<Value*>& args,
                                                const std::vector<Value*>* more) {
  std::vector<Value*> all = {frame_.context};
  all.insert(all.end(), args.begin(), args.end());
  std::vector<llvm::Type*> params;
  for (Value* arg : all) params.push_back(arg->getType());
  if (more) all.insert(all.end(), more->begin(), more->end());
  auto* type = llvm::FunctionType::get(result, params, more != nullptr);
  auto callee = e_.module.getOrInsertFunction(name, type);
  llvm::cast<llvm::Function>(callee.getCallee())->setDoesNotThrow();
  return b_.CreateCall(callee, all);
}

llvm::BasicBlock* FunctionGenerator::new_block(const std::string& name) {
  return llvm::BasicBlock::Create(e_.context(), name, frame_.function);
}

llvm::AllocaInst* FunctionGenerator::entry_alloca(llvm::Type* type, int64_t count,
                                                  const std::string& name) {
  const llvm::IRBuilderBase::InsertPointGuard guard(b_);
  b_.SetInsertPoint(frame_.entry);
  return b_.CreateAlloca(type, int64(count), name);
}

// Tags are types of LLVM's type-based alias analysis: siblings in its tree never overlap.
// Allocations have names of their own, so the tags hold across functions too.
llvm::MDNode* FunctionGenerator::alias_tag(const std::string& name) {
  llvm::MDBuilder md(e_.context());
  llvm::MDNode* root = md.createTBAARoot("retrograde");
  llvm::MDNode* type = md.createTBAAScalarTypeNode(name, root);
  return md.createTBAAStructTagNode(type, type, 0);
}

// ---- failures and branches ----

void FunctionGenerator::fail(Value* code) {
  if (!frame_.error_exit) {
    const llvm::IRBuilderBase::InsertPointGuard guard(b_);
    frame_.error_exit = new_block("error_exit");
    b_.SetInsertPoint(frame_.error_exit);
    frame_.error_code = b_.CreatePHI(b_.getInt32Ty(), 4, "error_code");
  }
  frame_.error_code->addIncoming(code, b_.GetInsertBlock());
  b_.CreateBr(frame_.error_exit);
}

void FunctionGenerator::fail_unless(Value* condition, const std::function<Value*()>& code) {
  llvm::BasicBlock *bad = new_block("bad"), *good = new_block("good");
  b_.CreateCondBr(condition, good, bad, llvm::MDBuilder(e_.context()).createLikelyBranchWeights());
  b_.SetInsertPoint(bad);
  {
    const MemoScope scope(*this, true);
    fail(code());
  }
  b_.SetInsertPoint(good);
}

void FunctionGenerator::if_true(Value* condition, const std::function<void()>& body) {
  llvm::BasicBlock *then_block = new_block("if_true"), *after = new_block("after");
  b_.CreateCondBr(condition, then_block, after);
  b_.SetInsertPoint(then_block);
  {
    const MemoScope scope(*this, true);
    body();
  }
  b_.CreateBr(after);
  b_.SetInsertPoint(after);
}

Value* FunctionGenerator::value_if(Value* condition, const std::function<Value*()>& body) {
  llvm::BasicBlock *before = b_.GetInsertBlock(), *end = nullptr;
  Value* given = nullptr;
  if_true(condition, [&] {
    given = body();
    end = b_.GetInsertBlock();
  });
  llvm::PHINode* result = b_.CreatePHI(given->getType(), 2);
  result->addIncoming(given, end);
  result->addIncoming(llvm::Constant::getNullValue(given->getType()), before);
  return result;
}

Value* FunctionGenerator::chosen(Value* condition, const std::function<Value*()>& then,
                                 const std::function<Value*()>& otherwise) {
  llvm::BasicBlock *then_block = new_block("then"), *else_block = new_block("else"),
                   *after = new_block("after");
  b_.CreateCondBr(condition, then_block, else_block);
  const auto arm = [&](llvm::BasicBlock* block, const std::function<Value*()>& make) {
    b_.SetInsertPoint(block);
    const MemoScope scope(*this, true);
    Value* given = make();
    b_.CreateBr(after);
    return std::pair(given, b_.GetInsertBlock());
  };
  const auto [a, a_end] = arm(then_block, then);
  const auto [b, b_end] = arm(else_block, otherwise);
  b_.SetInsertPoint(after);
  llvm::PHINode* result = b_.CreatePHI(a->getType(), 2);
  result->addIncoming(a, a_end);
  result->addIncoming(b, b_end);
  return result;
}

void FunctionGenerator::make(const Assert& s) {
  if (is_undef(s.error)) return;  // known to hold
  const MemoScope scope(*this, false);
  Value* condition = value(s.condition);
  fail_unless(condition, [&] { return value(s.error); });
}

void FunctionGenerator::make(const IfThenElse& s) {
  Value* condition = value_alone(s.condition);
  llvm::BasicBlock *then_block = new_block("then"), *after = new_block("after");
  llvm::BasicBlock* else_block = s.when_false.defined() ? new_block("else") : after;
  b_.CreateCondBr(condition, then_block, else_block);
  b_.SetInsertPoint(then_block);
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
  match(
      s, [&](const LetStmt& let) { make(let); }, [&](const Assert& a) { make(a); },
      [&](const ProducerConsumer& p) { statement(p.body); }, [&](const For& f) { make(f); },
      [&](const Store& store) { make(store); }, [&](const Allocate& a) { make(a); },
      [&](const Free& f) { make(f); },
      [&](const Block& block) {
        for (const Stmt& part : block.stmts) statement(part);
      },
      [&](const IfThenElse& branch) { make(branch); }, [&](const Fork& f) { make(f); },
      [&](const Atomic& a) { make(a); }, [&](const Evaluate& e) { value_alone(e.value); },
      [&](const StmtNode& node) {
        throw InternalError(
            text(kind_name(node.kind), " reached code generation: lowering replaces it"), "codegen",
            ir::print(s));
      });
}

void FunctionGenerator::make(const LetStmt& s) {
  // Chains of lets are long where bounds are computed: no recursion along them.
  const LetStmt* let = &s;
  for (;;) {
    {
      const MemoScope scope(*this, false);
      bind_let(let->name, let->value);
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
      return serial_loop(s);
    case ForType::Parallel:
      return parallel_loop(s);
    default:
      throw InternalError(
          "a vectorized or unrolled loop over " + quoted(s.name) + " reached code generation",
          "codegen", ir::print(Stmt(&s)));
  }
}

// Counts in 64 bits, where nothing wraps; the body sees the variable in its own width.
void FunctionGenerator::serial_loop(const For& s) {
  Value *min, *extent;
  {
    const MemoScope scope(*this, false);
    min = index64(s.min);
    extent = b_.CreateSExt(value(s.extent), b_.getInt64Ty());
  }
  Value* end = b_.CreateNSWAdd(min, extent);
  llvm::BasicBlock *before = b_.GetInsertBlock(), *body = new_block(s.name),
                   *after = new_block("end " + s.name);
  b_.CreateCondBr(b_.CreateICmpSGT(extent, b_.getInt64(0)), body, after);
  b_.SetInsertPoint(body);
  llvm::PHINode* counter = b_.CreatePHI(b_.getInt64Ty(), 2, s.name);
  counter->addIncoming(min, before);
  frame_.variables[s.name] = b_.CreateTrunc(counter, llvm_type(e_, s.min.type()));
  if (s.min.type() == Int(32)) frame_.indices[s.name] = counter;
  statement(s.body);
  Value* next = b_.CreateNSWAdd(counter, b_.getInt64(1));
  counter->addIncoming(next, b_.GetInsertBlock());
  b_.CreateCondBr(b_.CreateICmpSLT(next, end), body, after);
  b_.SetInsertPoint(after);
  frame_.indices.erase(s.name);
}

// ---- allocations ----

bool FunctionGenerator::fits_stack(const Allocate& s, int64_t elements) const {
  if (s.memory == MemoryType::Heap || elements < 0) return false;
  const StackLimit& limit = s.memory == MemoryType::Stack ? asked_for : free_choice;
  const int64_t element_bytes = s.type.bytes() * s.type.lanes();
  if (elements > limit.block_bytes / element_bytes) return false;
  return frame_.stack_bytes + elements * element_bytes + stack_padding_bytes <=
         limit.function_bytes;
}

FunctionGenerator::Storage FunctionGenerator::allocate_on_stack(const Allocate& s,
                                                                int64_t elements) {
  const int64_t bytes = elements * s.type.bytes() * s.type.lanes() + stack_padding_bytes;
  frame_.stack_bytes += bytes;
  llvm::AllocaInst* block = entry_alloca(b_.getInt8Ty(), bytes, s.name);
  block->setAlignment(llvm::Align(64));
  b_.CreateLifetimeStart(block, int64(bytes));
  return {block, nullptr, alias_tag(s.name)};
}

FunctionGenerator::Storage FunctionGenerator::allocate_on_heap(const Allocate& s) {
  Value* elements =
      b_.CreateIntCast(value_alone(s.elements), b_.getInt64Ty(), s.elements.type().is_int());
  Value* element_bytes = int64(int64_t{s.type.bytes()} * s.type.lanes());
  llvm::CallInst* block =
      call_runtime("retrograde_allocate", b_.getPtrTy(), {elements, element_bytes});
  block->setName(s.name);
  block->getCalledFunction()->setReturnDoesNotAlias();
  fail_unless(b_.CreateICmpNE(block, null_pointer()), [&] {
    return call_runtime("retrograde_allocation_error", b_.getInt32Ty(),
                        {string_constant(s.name), elements, element_bytes});
  });
  Value* slot = new_owned_slot();
  b_.CreateStore(block, slot);
  return {block, slot, alias_tag(s.name)};
}

Value* FunctionGenerator::new_owned_slot() {
  if (!frame_.owned_slots) frame_.owned_slots = entry_alloca(b_.getPtrTy(), 1, "owned");
  return b_.CreateConstGEP1_64(b_.getPtrTy(), frame_.owned_slots,
                               static_cast<uint64_t>(frame_.owned_count++));
}

void FunctionGenerator::free_owned(Storage& owned) {
  if (!owned.owned) return;
  call_runtime("retrograde_free", b_.getVoidTy(), {b_.CreateLoad(b_.getPtrTy(), owned.owned)});
  b_.CreateStore(null_pointer(), owned.owned);
}

void FunctionGenerator::make(const Allocate& s) {
  const auto elements = as_const_int(s.elements);
  const bool on_stack = elements && fits_stack(s, *elements);
  frame_.storages[s.name] = on_stack ? allocate_on_stack(s, *elements) : allocate_on_heap(s);
  statement(s.body);
  free_owned(
      frame_.storages[s.name]);  // after a Free the slot is null, and freeing null does nothing
  frame_.storages.erase(s.name);
}

void FunctionGenerator::make(const Free& s) { free_owned(storage(s.name)); }

}  // namespace retrograde::codegen
