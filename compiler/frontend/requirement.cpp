// requirement.cpp -- conditions that every call of a pipeline must meet.
#include "frontend/pipeline.h"
#include "ir/print.h"
#include "ir/visit.h"

namespace retrograde {

namespace {

[[noreturn]] void refuse(const Expr& condition, const std::string& rule,
                         const std::string& evidence, const std::string& instead) {
  user_error(text("require ", condition, " of a Pipeline's calls"), rule, evidence, instead);
}

// Parameters and their sizes are known when the call begins; nothing else is.
void check_uses_parameters_only(const Expr& condition) {
  ir::walk(condition, [&](const Expr& e) {
    const ir::Variable* variable = e.as<ir::Variable>();
    if (variable && !variable->symbol.defined()) {
      refuse(condition, "a requirement is checked once, before anything is computed",
             "it uses the Var " + quoted(variable->name), "Use require() inside a definition");
    }
    const ir::Call* call = e.as<ir::Call>();
    if (call && (call->call_type == ir::CallType::Func || call->call_type == ir::CallType::Image)) {
      refuse(condition, "a requirement is checked once, before anything is computed",
             "it reads " + quoted(call->name), "Use require() inside a definition");
    }
    return true;
  });
}

}  // namespace

void Pipeline::add_requirement(const Expr& condition, const std::vector<Expr>& message) {
  const ir::FuncPtr first = spec().outputs[0];
  if (!condition.defined() || !condition.type().is_bool() || !condition.type().is_scalar()) {
    user_error("add a requirement to the Pipeline of " + quoted(first->name),
               "a requirement is a condition of type bool",
               condition.defined() ? text("it is of type ", to_string(condition.type()))
                                   : "it is undefined",
               "Give a comparison of Params");
  }
  check_uses_parameters_only(condition);
  std::vector<Expr> parts = message;
  if (parts.empty()) parts.push_back(Expr(text("cannot run: it is required that ", condition)));
  first->requirements.push_back({condition, std::move(parts)});
  first->version++;
}

}  // namespace retrograde
