// specialize.cpp -- schedules of a stage that apply only under a condition.
//
// A stage's schedule owns a list of specializations, each a whole schedule that may be specialized
// again: a tree. A Stage handle holds the path from the stage to one of its schedules, so that it
// stays right when siblings are added.
#include "frontend/stage.h"
#include "graph/define.h"
#include "ir/equal.h"
#include "ir/print.h"
#include "ir/visit.h"

namespace retrograde {

namespace ir {

namespace {

// Why an expression has no single value in a call; empty when it has.
std::string varying_part(const Expr& root) {
  std::string part;
  walk(root, [&](const Expr& e) {
    if (!part.empty()) return false;
    if (const Variable* v = e.as<Variable>()) {
      if (!std::dynamic_pointer_cast<ParameterContents>(v->symbol.lock()))
        part = text(quoted(v->name), " is a variable of loops");
    }
    if (const Call* call = e.as<Call>()) {
      if (call->call_type == CallType::Func)
        part = text(e, " is a value of the Func ", quoted(call->name));
      if (call->call_type == CallType::Image)
        part = text(e, " is an element of the image ", quoted(call->name));
      if (call->is_op(Op::random)) part = text(e, " is random");
    }
    return part.empty();
  });
  return part;
}

}  // namespace

void check_over_parameters(const Expr& e, const char* what, const std::string& asked) {
  const std::string part = varying_part(e);
  if (part.empty()) return;
  user_error(asked,
             text(what,
                  " has one value in each call: it is made of parameters and facts "
                  "about buffers"),
             part, "Use a Param, or a fact such as in.dim(0).extent()");
}

}  // namespace ir

const ir::StageSchedule& Stage::schedule() const {
  const ir::StageSchedule* result = &definition().schedule;
  for (int step : specialization_) result = &result->specializations[step];
  return *result;
}

ir::StageSchedule& Stage::touch() const {
  func_->version++;
  ir::StageSchedule* result = &func_->stage(index_).schedule;
  result->touched = true;
  for (int step : specialization_) {
    result = &result->specializations[step];
    result->touched = true;
  }
  return *result;
}

namespace {

Stage specialization_of(const ir::FuncPtr& func, int index, std::vector<int> path, size_t child) {
  path.push_back(static_cast<int>(child));
  return Stage(func, index, std::move(path));
}

void check_not_closed(const ir::StageSchedule& schedule, const std::string& asked) {
  if (schedule.specializations.empty() || schedule.specializations.back().failure.empty()) return;
  user_error(asked, "specialize_fail is the last of a stage's specializations",
             "specialize_fail was called already", "Specialize before specialize_fail");
}

}  // namespace

// 1. The condition is a scalar bool. 2. It is over parameters. 3. No specialize_fail came before.
// 4. The stage does not join the loops of another.
Stage Stage::specialize(const Expr& condition) {
  const std::string asked = "specialize " + quoted(name());
  if (!condition.defined())
    user_error(asked, "the condition is a defined expression", "it was never assigned",
               "Assign every Expr before it is used");
  if (!condition.type().is_bool() || !condition.type().is_scalar()) {
    user_error(asked, "the condition is of type bool",
               text(condition, " has type ", to_string(condition.type())),
               "Compare it with something");
  }
  ir::check_over_parameters(condition, "the condition", asked);
  const ir::StageSchedule& now = schedule();
  for (size_t i = 0; i < now.specializations.size(); i++) {
    const Expr& earlier = now.specializations[i].condition;
    if (earlier.defined() && ir::equal(earlier, condition))
      return specialization_of(func_, index_, specialization_, i);
  }
  check_not_closed(now, asked);
  if (now.fuse_level.kind == ir::LoopLevel::Kind::At) {
    user_error(asked, "a stage that joins the loops of another one has no specializations",
               text("compute_with put it into the loops of ", quoted(now.fuse_level.func)),
               "Specialize the other stage, or leave compute_with out");
  }
  ir::StageSchedule copy = now;
  copy.specializations.clear();
  copy.condition = condition;
  copy.failure.clear();
  ir::StageSchedule& changed = touch();
  changed.specializations.push_back(std::move(copy));
  return specialization_of(func_, index_, specialization_, changed.specializations.size() - 1);
}

void Stage::specialize_fail(const std::string& message) {
  const std::string asked = text("let ", quoted(name()), " fail when no specialization applies");
  if (message.empty()) {
    user_error(asked, "the message says something", "it is empty",
               "Say which inputs the pipeline is for");
  }
  check_not_closed(schedule(), asked);
  ir::StageSchedule failing;
  failing.dims = schedule().dims;
  failing.splits = schedule().splits;
  failing.failure = message;
  touch().specializations.push_back(std::move(failing));
}

}  // namespace retrograde
