// requirement.cpp -- conditions that every call of a pipeline must meet.
#include "frontend/run/pipeline.h"
#include "ir/print.h"
#include "ir/visit.h"

namespace retrograde {

namespace {

// Only parameters and their sizes are known when the call begins. `part` is the condition or a value of its message.
void check_uses_parameters_only(const Expr& part, const std::string& asked) {
  const auto refuse = [&](const std::string& evidence) {
    user_error(asked, "a requirement is checked once, before anything is computed", evidence,
               "Use require() inside a definition");
  };
  ir::walk(
      part,
      [&](const ir::Variable& variable) {
        if (!variable.symbol.defined()) refuse("it uses the Var " + quoted(variable.name));
      },
      [&](const ir::Call& call) {
        if (call.call_type == ir::CallType::Func || call.call_type == ir::CallType::Image)
          refuse("it reads " + quoted(call.name));
      });
}

}  // namespace

void Pipeline::add_requirement(const Expr& condition, const std::vector<Expr>& message) {
  const graph::FuncPtr first = spec().outputs[0];
  if (!condition.defined() || !condition.type().is_bool() || !condition.type().is_scalar()) {
    user_error("add a requirement to the Pipeline of " + quoted(first->name),
               "a requirement is a condition of type bool",
               condition.defined() ? text("it is of type ", to_string(condition.type()))
                                   : "it is undefined",
               "Give a comparison of Params");
  }
  check_uses_parameters_only(condition, text("require ", condition, " of a Pipeline's calls"));
  for (const Expr& part : message) {
    const std::string asked = "add a requirement to the Pipeline of " + quoted(first->name);
    if (!part.defined()) {
      user_error(asked, "every part of its message is a defined expression",
                 "one was never assigned", "Assign every Expr before it is used");
    }
    check_uses_parameters_only(part, text(asked, " whose message shows ", part));
  }
  std::vector<Expr> parts = message;
  if (parts.empty()) parts.push_back(Expr(text("cannot run: it is required that ", condition)));
  first->requirements.push_back({condition, std::move(parts)});
  first->version++;
}

}  // namespace retrograde
