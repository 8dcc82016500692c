#include "codegen/cpu/long_functions.h"

#include "codegen/function_generator.h"
#include "ir/node_count.h"

namespace retrograde::codegen {

using namespace ir;

namespace {

// Measured in nodes of the lowered statement.
constexpr int long_body = 5000, least_loop = 100;

}  // namespace

bool is_long(const Stmt& body) { return body.defined() && !has_at_most_nodes(body, long_body); }

// A loop inside a profiled region stays, because the profiler is notified by the function that contains it.
bool FunctionGenerator::is_worth_a_function(const For& s) const {
  return is_long_ && loops_around_ == 0 && !device_ && c_.frame.exit_calls.empty() &&
         !has_at_most_nodes(Stmt(&s), least_loop);
}

void FunctionGenerator::called_loop(const For& s) {
  const Task task = outline(Stmt(&s), "loop", s.name);
  Value* code = b_.CreateCall(task.function, {c_.frame.context, b_.getInt32(0), task.closure});
  c_.fail_unless(b_.CreateICmpEQ(code, b_.getInt32(0)), [&] { return code; });
}

}  // namespace retrograde::codegen
