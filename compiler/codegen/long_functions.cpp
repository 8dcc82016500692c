#include "codegen/long_functions.h"

#include "codegen/function_generator.h"
#include "ir/visit.h"

namespace retrograde::codegen {

using namespace ir;

namespace {

// In nodes of the lowered statement.
constexpr int long_body = 5000, least_loop = 100;

// Whether it has more nodes.
bool has_more_nodes(const Stmt& s, int than) {
  int count = 0;
  const auto visit = [&](const auto&) { return ++count <= than; };
  walk(
      s, [&](const Expr& e) { return visit(e); }, [&](const Stmt& part) { return visit(part); });
  return count > than;
}

}  // namespace

bool is_long(const Stmt& body) { return body.defined() && has_more_nodes(body, long_body); }

// The profiler is told of what runs by the function that it runs in.
bool FunctionGenerator::is_worth_a_function(const For& s) const {
  return is_long_ && loops_around_ == 0 && !device_ && c_.frame.farewells.empty() &&
         has_more_nodes(Stmt(&s), least_loop);
}

void FunctionGenerator::called_loop(const For& s) {
  const Task task = outline(Stmt(&s), "loop", s.name);
  Value* code = b_.CreateCall(task.function, {c_.frame.context, b_.getInt32(0), task.closure});
  c_.fail_unless(b_.CreateICmpEQ(code, b_.getInt32(0)), [&] { return code; });
}

}  // namespace retrograde::codegen
