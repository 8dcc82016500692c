// drop_checks -- remove bounds queries or checks that the target disables.
// In:  any phase. Out: the same phase.
//
//   if (is_query(in) || is_query(out)) {         assert !is_query(in), "... \"in\" ..."
//     answers                             =>     assert !is_query(out), "... \"out\" ..."
//   } else {                                     body
//     body
//   }
//
//   assert c, message                     =>     (nothing)
//   assert c, 0                           =>     unchanged: it returns without reporting
//
// drop_asserts runs last, because the simplifier derives facts from the checks. Failing allocations are not Asserts and
// stay errors. Tests: test/golden/lower/drop_*/.
#include "lower/statement_passes.h"

#include "diagnostics/error.h"
#include "ir/build.h"
#include "ir/visit.h"
#include "lower/checks/buffer_checks.h"
#include "lower/checks/run_time_check.h"
#include "lower/statement_rewriter.h"
#include "retrograde_runtime.h"

namespace retrograde::lower {
namespace {

bool is_query(const Expr& e) {
  const auto* call = e.as<Call>();
  return call && call->call_type == CallType::Operator && call->op == Op::buffer_is_query;
}

std::vector<Expr> queries_in(const Expr& condition) {
  std::vector<Expr> found;
  walk(condition, [&](const Expr& e) {
    if (is_query(e)) found.push_back(e);
    return true;
  });
  return found;
}

// "in" of is_query(in.buffer)
std::string buffer_name(const Expr& query) {
  const auto* handle = query.as<Call>()->args[0].as<Variable>();
  RETROGRADE_ASSERT(handle != nullptr, "a bounds query of something that is no buffer");
  return handle->name.substr(0, handle->name.rfind(".buffer"));
}

Stmt refuse(const Expr& query) {
  const std::string message =
      "cannot run: the buffer " + quoted(buffer_name(query)) +
      " must have memory, because the target says no_bounds_query; its host pointer is null. "
      "Allocate it, or compile without no_bounds_query.";
  return run_time_check(!query, retrograde_error_host_is_null, message);
}

bool may_report(const Stmt& s) {
  const auto* assert = s.as<Assert>();
  return assert ? !is_zero(assert->error) : is_check_by_runtime(s);
}

}  // namespace

Stmt drop_bounds_query(const Stmt& all) {
  return rewrite_statements(all, [](const Stmt& s, auto& rewriter) {
    const auto* branch = s.as<IfThenElse>();
    const std::vector<Expr> queries = branch ? queries_in(branch->condition) : std::vector<Expr>();
    if (queries.empty()) return rewriter.children(s);
    std::vector<Stmt> parts = mapped(queries, [&](const Expr& query) { return refuse(query); });
    if (branch->when_false.defined()) parts.push_back(branch->when_false);
    return make_block(parts);
  });
}

Stmt drop_asserts(const Stmt& all) {
  return rewrite_statements(all, [](const Stmt& s, auto& rewriter) {
    if (may_report(s)) return make_evaluate(0);
    const auto* block = s.as<Block>();
    if (!block) return rewriter.children(s);
    std::vector<Stmt> kept;
    for (const Stmt& part : block->stmts) {
      if (!may_report(part)) kept.push_back(rewriter(part));
    }
    return kept.empty() ? make_evaluate(0) : make_block(kept);
  });
}

}  // namespace retrograde::lower
