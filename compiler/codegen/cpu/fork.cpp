// Fork: both statements become tasks, like bodies of parallel loops. The runtime runs the first on a thread of its own.
//
//   fork { first } { rest }  =>  code = retrograde_fork(context, task1, &closure1,
//                                                       task2, &closure2, semaphores, count)
//                                if (code) fail(code)
//
// The semaphores are those that either statement names and that are allocated outside the Fork. If a statement fails,
// the runtime closes them, so the other one does not wait forever.
#include <set>

#include "codegen/function_generator.h"
#include "codegen/memory/access.h"
#include "ir/build.h"
#include "ir/visit.h"

namespace retrograde::codegen {

using namespace ir;

namespace {

// The distinct addresses that are passed to retrograde_semaphore_acquire.
std::vector<const Load*> semaphores_in(const Fork& s) {
  std::vector<const Load*> found;
  std::set<std::pair<std::string, int64_t>> seen;
  const auto visit = [&](const Expr& e) {
    const auto* call = as_op(e, Op::runtime_call);
    const auto* name = call ? call->args[0].as<StringImm>() : nullptr;
    if (!name || name->value != "retrograde_semaphore_acquire") return true;
    const auto* address = as_op(call->args[1], Op::address_of);
    const auto* load = address ? address->args[0].as<Load>() : nullptr;
    const auto index = load ? as_const_int(load->index) : std::nullopt;
    if (index && seen.emplace(load->name, *index).second) found.push_back(load);
    return true;
  };
  const auto all = [](const Stmt&) { return true; };
  walk(s.first, visit, all);
  walk(s.rest, visit, all);
  return found;
}

}  // namespace

void FunctionGenerator::make(const Fork& s) {
  auto* pointer = b_.getPtrTy();
  std::vector<Value*> semaphores;
  {
    const MemoScope scope(c_.frame, false);
    for (const Load* load : semaphores_in(s)) {
      const auto found = c_.frame.storages.find(load->name);
      if (found == c_.frame.storages.end()) continue;  // allocated inside a branch
      semaphores.push_back(
          element_pointer(e_, found->second, load->type, values_.index64(load->index)));
    }
  }
  const auto count = static_cast<int64_t>(semaphores.size());
  Value* list = c_.entry_alloca(pointer, std::max<int64_t>(count, 1), "semaphores");
  for (unsigned i = 0; i < semaphores.size(); i++)
    b_.CreateStore(semaphores[i], b_.CreateConstGEP1_64(pointer, list, i));
  const Task first = outline(s.first, "parallel", "fork"),
             rest = outline(s.rest, "parallel", "join");
  Value* code = c_.call_runtime("retrograde_fork", b_.getInt32Ty(),
                                {first.function, first.closure, rest.function, rest.closure, list,
                                 b_.getInt32(semaphores.size())});
  c_.fail_unless(b_.CreateICmpEQ(code, b_.getInt32(0)), [&] { return code; });
}

}  // namespace retrograde::codegen
