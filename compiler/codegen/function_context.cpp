// Early exits: every failure jumps to one block of its function, which frees the heap blocks still held and returns the
// code. Each Allocate keeps its block in a slot of a stack array; the slot is null before and after. The array stays in
// memory because the runtime gets its address: in registers, n slots alive at n failures would need n^2 copies.
#include "codegen/function_context.h"

#include <llvm/IR/MDBuilder.h>

#include "diagnostics/error.h"

namespace retrograde::codegen {

// ---- functions ----

void FunctionContext::begin(llvm::Function* function) {
  set_target(e, function);
  frame.function = function;
  if (!e.machine.is_device()) {
    frame.context = function->getArg(0);
    frame.context->setName("context");
  }
  frame.entry = llvm::BasicBlock::Create(e.context(), "entry", function);
  b.SetInsertPoint(new_block("body"));
  frame.memo.push_back({{}, {}, false});
}

void FunctionContext::finish(Value* code) {
  code ? b.CreateRet(code) : b.CreateRetVoid();
  Value* count = int64(frame.owned_count);
  if (frame.error_exit) {
    b.SetInsertPoint(frame.error_exit);
    for (auto due = frame.exit_calls.rbegin(); due != frame.exit_calls.rend(); ++due)
      call_runtime(due->function, b.getInt32Ty(), {b.CreateLoad(b.getPtrTy(), due->argument)});
    if (frame.owned_slots)
      call_runtime("retrograde_free_all", b.getVoidTy(), {frame.owned_slots, count});
    b.CreateRet(frame.error_code);
  }
  b.SetInsertPoint(frame.entry);
  if (frame.owned_slots) {
    frame.owned_slots->setOperand(0, count);
    b.CreateMemSet(frame.owned_slots, b.getInt8(0), static_cast<uint64_t>(8 * frame.owned_count),
                   llvm::Align(8));
  }
  for (const auto& due : frame.exit_calls) b.CreateStore(null_pointer(), due.argument);
  b.CreateBr(&*std::next(frame.function->begin()));
}

llvm::CallInst* FunctionContext::call_runtime(const std::string& name, llvm::Type* result,
                                              const std::vector<Value*>& args,
                                              const std::vector<Value*>* more) {
  if (!frame.context) {
    unsupported("run a part of a pipeline on a GPU", "a kernel cannot call functions of the host",
                "it would call " + quoted(name), "Compute that part on the host");
  }
  std::vector<Value*> all = {frame.context};
  all.insert(all.end(), args.begin(), args.end());
  std::vector<llvm::Type*> params;
  for (Value* arg : all) params.push_back(arg->getType());
  if (more) all.insert(all.end(), more->begin(), more->end());
  auto* type = llvm::FunctionType::get(result, params, more != nullptr);
  auto callee = e.module.getOrInsertFunction(name, type);
  llvm::cast<llvm::Function>(callee.getCallee())->setDoesNotThrow();
  return b.CreateCall(callee, all);
}

llvm::BasicBlock* FunctionContext::new_block(const std::string& name) {
  return llvm::BasicBlock::Create(e.context(), name, frame.function);
}

llvm::AllocaInst* FunctionContext::entry_alloca(llvm::Type* type, int64_t count,
                                                const std::string& name) {
  const llvm::IRBuilderBase::InsertPointGuard guard(b);
  b.SetInsertPoint(frame.entry);
  return b.CreateAlloca(type, int64(count), name);
}

// Tags are types of LLVM's type-based alias analysis: siblings in its tree never alias. Allocations have unique names,
// so the tags hold across functions too.
llvm::MDNode* alias_tag(Emitter& e, const std::string& name) {
  llvm::MDBuilder md(e.context());
  llvm::MDNode* root = md.createTBAARoot("retrograde");
  llvm::MDNode* type = md.createTBAAScalarTypeNode(name, root);
  return md.createTBAAStructTagNode(type, type, 0);
}

// ---- failures and branches ----

void FunctionContext::fail(Value* code) {
  if (!frame.error_exit) {
    const llvm::IRBuilderBase::InsertPointGuard guard(b);
    frame.error_exit = new_block("error_exit");
    b.SetInsertPoint(frame.error_exit);
    frame.error_code = b.CreatePHI(b.getInt32Ty(), 4, "error_code");
  }
  frame.error_code->addIncoming(code, b.GetInsertBlock());
  b.CreateBr(frame.error_exit);
}

void FunctionContext::fail_unless(Value* condition, const std::function<Value*()>& code) {
  llvm::BasicBlock *bad = new_block("bad"), *good = new_block("good");
  b.CreateCondBr(condition, good, bad, llvm::MDBuilder(e.context()).createLikelyBranchWeights());
  b.SetInsertPoint(bad);
  {
    const MemoScope scope(frame, true);
    fail(code());
  }
  b.SetInsertPoint(good);
}

void FunctionContext::if_true(Value* condition, const std::function<void()>& body) {
  llvm::BasicBlock *then_block = new_block("if_true"), *after = new_block("after");
  b.CreateCondBr(condition, then_block, after);
  b.SetInsertPoint(then_block);
  {
    const MemoScope scope(frame, true);
    body();
  }
  b.CreateBr(after);
  b.SetInsertPoint(after);
}

Value* FunctionContext::value_if(Value* condition, const std::function<Value*()>& body,
                                 Value* otherwise) {
  llvm::BasicBlock *before = b.GetInsertBlock(), *end = nullptr;
  Value* given = nullptr;
  if_true(condition, [&] {
    given = body();
    end = b.GetInsertBlock();
  });
  llvm::PHINode* result = b.CreatePHI(given->getType(), 2);
  result->addIncoming(given, end);
  result->addIncoming(otherwise ? otherwise : llvm::Constant::getNullValue(given->getType()),
                      before);
  return result;
}

Value* FunctionContext::chosen(Value* condition, const std::function<Value*()>& then,
                               const std::function<Value*()>& otherwise) {
  llvm::BasicBlock *then_block = new_block("then"), *else_block = new_block("else"),
                   *after = new_block("after");
  b.CreateCondBr(condition, then_block, else_block);
  const auto arm = [&](llvm::BasicBlock* block, const std::function<Value*()>& make) {
    b.SetInsertPoint(block);
    const MemoScope scope(frame, true);
    Value* given = make();
    b.CreateBr(after);
    return std::pair(given, b.GetInsertBlock());
  };
  const auto [one, one_end] = arm(then_block, then);
  const auto [other, other_end] = arm(else_block, otherwise);
  b.SetInsertPoint(after);
  llvm::PHINode* result = b.CreatePHI(one->getType(), 2);
  result->addIncoming(one, one_end);
  result->addIncoming(other, other_end);
  return result;
}

// ---- names ----

Storage& FunctionContext::storage(const std::string& name) {
  const auto found = frame.storages.find(name);
  RETROGRADE_ASSERT(found != frame.storages.end(), "no memory named ", quoted(name), " in ",
                    function_name);
  return found->second;
}

Value* FunctionContext::block_name(const std::string& name) {
  const auto found = frame.block_names.find(name);
  return found == frame.block_names.end() ? string_constant(name) : found->second;
}

Value* FunctionContext::string_constant(const std::string& text) {
  Value*& constant = strings_[text];
  if (!constant) {
    auto* global = b.CreateGlobalString(text, "text");
    global->setAlignment(
        llvm::Align(8));  // aligned as memory that holds more than bytes: the low bits are free
    constant = global;
  }
  return constant;
}

}  // namespace retrograde::codegen
