// Parallel loops: the body becomes a separate function. A struct on the caller's stack (the closure) passes it the
// values that it uses from outside the loop.
//
//   parallel x in [min, min + extent): body
//      =>
//   closure = {a, b, &block}
//   code = retrograde_parallel_for(context, task, min, extent, &closure)
//   if (code) fail(code)
//
//   int32 task(context, x, closure): a = closure->a ...; body
#include <set>

#include "codegen/function_generator.h"
#include "ir/visit.h"

namespace retrograde::codegen {

using namespace ir;

namespace {

struct Uses {
  std::set<std::string> variables,
      storages;  // sorted, so that the closure's layout is deterministic
};

// Every name in the statement, including those that it binds itself.
Uses names_in(const Stmt& s) {
  Uses uses;
  walk(
      s, [&](const Variable& n) { uses.variables.insert(n.name); },
      [&](const Load& n) { uses.storages.insert(n.name); },
      [&](const Store& n) { uses.storages.insert(n.name); });
  return uses;
}

}  // namespace

FunctionGenerator::Task FunctionGenerator::outline(const Stmt& body, const std::string& what,
                                                   const std::string& name,
                                                   const std::string& index, Type index_type) {
  const Uses uses = names_in(body);
  std::vector<std::string> variables, storages;
  std::vector<Value*> captured;
  for (const std::string& variable : uses.variables) {
    const auto found = c_.frame.variables.find(variable);
    if (found == c_.frame.variables.end() || variable == index) continue;
    variables.push_back(variable);
    captured.push_back(found->second);
  }
  for (const std::string& storage : uses.storages) {
    const auto found = c_.frame.storages.find(storage);
    if (found == c_.frame.storages.end()) continue;
    storages.push_back(storage);
    captured.push_back(found->second.base);
  }
  const auto fields = ir::mapped(captured, [&](Value* v) { return v->getType(); });
  auto* closure_type = llvm::StructType::get(e_.context(), fields);
  Value* closure = c_.entry_alloca(closure_type, 1, name + ".closure");
  for (unsigned i = 0; i < captured.size(); i++) {
    b_.CreateStore(captured[i], b_.CreateStructGEP(closure_type, closure, i));
  }

  auto* pointer = b_.getPtrTy();
  auto* int32 = b_.getInt32Ty();
  auto* task_type = llvm::FunctionType::get(int32, {pointer, int32, pointer}, false);
  const std::string task_name =
      source_.name + "." + what + std::to_string(outlined_++) + "." + name;
  auto* task =
      llvm::Function::Create(task_type, llvm::GlobalValue::InternalLinkage, task_name, e_.module);
  const llvm::IRBuilderBase::InsertPointGuard guard(b_);
  Frame outer = std::move(c_.frame);
  c_.frame = {};
  c_.begin(task);
  for (unsigned i = 0; i < captured.size(); i++) {
    Value* field = b_.CreateStructGEP(closure_type, task->getArg(2), i);
    auto* load = b_.CreateLoad(fields[i], field);
    load->setMetadata(llvm::LLVMContext::MD_invariant_load, llvm::MDNode::get(e_.context(), {}));
    if (i < variables.size()) {
      c_.frame.variables[variables[i]] = load;
    } else {
      const std::string& storage = storages[i - variables.size()];
      c_.frame.storages[storage] = {load, nullptr, outer.storages[storage].alias};
    }
  }
  if (!index.empty())
    c_.frame.variables[index] = b_.CreateIntCast(task->getArg(1), llvm_type(e_, index_type), true);
  ++loops_around_;
  statement(body);
  --loops_around_;
  c_.finish(b_.getInt32(0));
  c_.frame = std::move(outer);
  return {task, closure};
}

void FunctionGenerator::parallel_loop(const For& s) {
  Value *min, *extent;
  {
    const MemoScope scope(c_.frame, false);
    min = b_.CreateIntCast(values_.of(s.min), b_.getInt32Ty(), true);
    extent = b_.CreateIntCast(values_.of(s.extent), b_.getInt32Ty(), true);
  }
  const Task task = outline(s.body, "parallel", s.name, s.name, s.min.type());
  Value* code = c_.call_runtime("retrograde_parallel_for", b_.getInt32Ty(),
                                {task.function, min, extent, task.closure});
  c_.fail_unless(b_.CreateICmpEQ(code, b_.getInt32(0)), [&] { return code; });
}

}  // namespace retrograde::codegen
