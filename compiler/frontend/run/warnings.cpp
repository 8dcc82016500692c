// warnings.cpp -- finds suspicious definitions and directives without compiling. Findings never change a program:
//
//   f(x) = g(x);  f(x) = h(x)              the first definition is computed and thrown away
//   f.vectorize(x, 8), f.update() without  the update was forgotten
//   f.vectorize(x, 1)                      a vector of one lane
//   f.update().atomic() alone              no loop of the update is parallel or vectorized
//   RDom r(0, 0)                           the update never runs
//   f.specialize(true)                     a constant condition
//   require(1 > 2, ...)                    every call fails
//   f.bound(x, 0, 9) of an inlined f       no loop runs over f's region
//   a gradient without a schedule          the compiler chooses one
//   float16 without f16c                   each conversion takes many instructions
#include "frontend/run/warnings.h"

#include <algorithm>
#include <mutex>
#include <utility>

#include "diagnostics/error.h"
#include "graph/directives/give_directive.h"
#include "graph/directives/wrappers.h"
#include "ir/build.h"
#include "ir/memory_reads.h"
#include "ir/print.h"
#include "ir/visit.h"

namespace retrograde::frontend {
namespace {

// Whether the update overwrites every element independently of its old value.
bool overwrites_all(const FuncContents& f, const Definition& update) {
  if (update.predicate.defined() || !update.rvars.empty()) return false;
  for (size_t d = 0; d < f.args.size(); d++) {
    const auto* variable = update.args[d].as<Variable>();
    if (!variable || variable->name != f.args[d]) return false;
  }
  return std::ranges::none_of(
      update.values, [&](const Expr& value) { return is_undef(value) || calls(value, &f); });
}

std::string words_for_stage(const FuncContents& f, int stage) {
  return stage == 0 ? quoted(f.name) : text("update ", stage - 1, " of ", quoted(f.name));
}

// Number of Funcs without directives; 0 if there are no adjoints among them.
size_t unscheduled_beside_adjoints(const std::vector<FuncPtr>& funcs) {
  size_t count = 0;
  bool has_adjoints = false;
  for (const FuncPtr& f : funcs) {
    if (has_directives(*f) || f->is_extern()) continue;
    ++count;
    has_adjoints = has_adjoints || f->made;
  }
  return has_adjoints ? count : 0;
}

class Findings {
 public:
  explicit Findings(std::vector<std::string>& messages) : messages_(messages) {}

  void look_at(const FuncContents& f, bool with_hidden) {
    if (f.is_extern()) return;
    if (with_hidden) find_hidden(f);
    find_forgotten(f);
    for (int s = 0; s < f.stage_count(); s++) {
      find_empty_domain(f, s);
      find_failing_requirement(f, s);
      find_idle(f, s, f.stage(s).schedule);
    }
  }

  void note_default_schedule(const std::vector<FuncPtr>& funcs, const FuncContents& output) {
    const size_t count = unscheduled_beside_adjoints(funcs);
    if (count == 0) return;
    add("performance note: the compiler schedules the gradient " + quoted(output.name),
        text(count, " of its ", funcs.size(), " Funcs have no directive, adjoints among them"),
        "Schedule them, call Pipeline::auto_schedule() to see and edit the schedule, set its "
        "options "
        "with set_autoschedule(), or call Pipeline::unscheduled() for no schedule");
  }

  void note_slow_floats(const FuncContents& f, const Target& target) {
    const std::vector<Target::Feature> converting = {Target::F16C,
                                                     Target::AVX512,
                                                     Target::AVX512_KNL,
                                                     Target::AVX512_Skylake,
                                                     Target::AVX512_Cannonlake,
                                                     Target::AVX512_SapphireRapids};
    if (target.arch != Target::X86 || target.features_any_of(converting) || f.is_extern()) return;
    bool has_halves = false;
    for (int s = 0; s < f.stage_count() && !has_halves; s++) {
      for_each_expr(f.stage(s), [&](const Expr& root) {
        walk(root, [&](const Expr& e) {
          has_halves =
              has_halves || (e.type().is_float() && e.type().bits() == 16 && !e.type().is_bfloat());
          return !has_halves;
        });
      });
    }
    if (!has_halves) return;
    add("performance note: " + quoted(f.name) + " converts float16 by software",
        "the target " + quoted(target.to_string()) + " has no f16c",
        "Add the feature f16c where the machine has it, or keep values in float32");
  }

  // Outputs and Funcs with updates always have loops of their own, so their bounds are not idle.
  void find_idle_bounds(const FuncContents& f) {
    if (f.is_extern() || !f.updates.empty()) return;
    if (f.schedule.compute_level.kind != graph::LoopLevel::Kind::Inlined) return;
    for (const graph::Bound& bound : f.schedule.bounds) {
      add("the directive about the bounds of " + quoted(bound.var) + " of " + quoted(f.name) +
              " changes nothing",
          quoted(f.name) + " is inlined: it is computed at each point that its consumers read",
          "Compute it in a loop or at root, or leave the bounds out");
    }
  }

  void find_hidden(const FuncContents& f) {
    for (int s = f.stage_count() - 1; s > 0; s--) {
      if (!overwrites_all(f, f.stage(s))) continue;
      if (s == 1 && is_undef(f.pure->values[0])) return;
      const std::string earlier =
          s == 1 ? "its first definition" : text("its first ", s, " definitions");
      add(words_for_stage(f, s) + " hides the earlier definitions",
          "it stores every element and reads none of " + quoted(f.name) + ", so " + earlier +
              (s == 1 ? " has no effect" : " have no effect"),
          "Leave them out, or give the new values a Func of their own");
      return;
    }
  }

 private:
  std::vector<std::string>& messages_;

  void add(const std::string& what, const std::string& evidence, const std::string& instead) {
    messages_.push_back(what + ": " + evidence + ". " + instead + ".");
  }

  void find_forgotten(const FuncContents& f) {
    bool any = false;
    for (int s = 0; s < f.stage_count(); s++) any = any || f.stage(s).schedule.is_given;
    for (int s = 1; any && s < f.stage_count(); s++) {
      if (f.stage(s).schedule.is_given) continue;
      add(words_for_stage(f, s) + " has no schedule",
          "other definitions of " + quoted(f.name) + " have one, which applies to them alone",
          text("Schedule it through update(", s - 1, "), or call update(", s - 1,
               ").unscheduled()"));
    }
  }

  void find_empty_domain(const FuncContents& f, int s) {
    for (const ReductionVariable& var : f.stage(s).rvars) {
      const auto extent = as_const_int(var.extent);
      if (!extent || *extent > 0) continue;
      add(words_for_stage(f, s) + " never runs",
          text("the extent of ", quoted(var.var), " is ", *extent),
          "Give the reduction domain a positive extent, or leave the update out");
    }
  }

  void find_failing_requirement(const FuncContents& f, int s) {
    walk(f.stage(s), [&](const Call& call) {
      if (!call.is_op(Op::require) || as_const_int(call.args[0]) != 0) return;
      add(words_for_stage(f, s) + " has a requirement that never holds",
          "the condition does not depend on the call, and is false",
          "Require a condition on parameters or facts about buffers");
    });
  }

  void find_idle(const FuncContents& f, int s, const StageLoops& schedule) {
    find_single_lanes(f, s, schedule);
    find_idle_atomic(f, s, schedule);
    for (const StageLoops& special : schedule.specializations) {
      if (special.condition.defined() && as_const_int(special.condition)) {
        add("a specialization of " + words_for_stage(f, s) + " does not depend on the call",
            text("its condition is ", special.condition),
            "Give a condition on parameters, or schedule the stage itself");
      }
      find_idle(f, s, special);
    }
  }

  void find_single_lanes(const FuncContents& f, int s, const StageLoops& schedule) {
    for (const Dim& dim : schedule.dims) {
      const bool is_vector = dim.runs == ForType::Vectorized;
      if (!is_vector && dim.runs != ForType::Unrolled) continue;
      for (const Split& split : schedule.splits) {
        if (split.kind != Split::Kind::Split || split.inner != dim.var) continue;
        if (as_const_int(split.factor) != 1) continue;
        add(text(is_vector ? "vectorizing " : "unrolling ", quoted(split.old_var), " of ",
                 words_for_stage(f, s), " by 1 changes nothing"),
            "the loop runs once", "Give a larger factor, or leave the directive out");
      }
    }
  }

  void find_idle_atomic(const FuncContents& f, int s, const StageLoops& schedule) {
    if (!schedule.atomic || !schedule.specializations.empty()) return;
    for (const Dim& dim : schedule.dims) {
      if (dim.is_reduction && dim.runs != ForType::Serial && dim.runs != ForType::Unrolled) return;
    }
    add("atomic() of " + words_for_stage(f, s) + " changes nothing",
        "none of its reduction loops is parallel or vectorized",
        "Make one parallel or vectorized, or leave atomic() out");
  }
};

}  // namespace

std::vector<std::string> warnings_of(const std::vector<FuncPtr>& outputs, bool with_hidden,
                                     const Target& target) {
  std::vector<std::string> messages;
  Findings findings(messages);
  const std::vector<FuncPtr> funcs = functions_of(outputs);
  for (const FuncPtr& f : funcs) {
    findings.look_at(*f, with_hidden);
    findings.note_slow_floats(*f, target);
  }
  const bool may_be_placed =
      unscheduled_beside_adjoints(funcs) > 0;  // the compiler may choose levels
  for (const FuncPtr& f : funcs) {
    if (!may_be_placed && !std::ranges::count(outputs, f)) findings.find_idle_bounds(*f);
  }
  findings.note_default_schedule(funcs, *outputs[0]);
  return messages;
}

namespace {
// A scope belongs to the thread that opened it.
thread_local std::function<void(const std::string&)> listener;

struct ProcessHandler {
  std::mutex mutex;
  WarningHandler tell;
};
ProcessHandler& process_handler() {
  static ProcessHandler handler;
  return handler;
}
WarningHandler handler_of_process() {
  std::lock_guard lock(process_handler().mutex);
  return process_handler().tell;
}
}  // namespace

bool has_warning_scope() { return static_cast<bool>(listener); }

void tell_warning(const std::string& warning) {
  if (listener) return listener(warning);
  if (const WarningHandler tell = handler_of_process()) tell(warning);
}

void tell_warnings(const std::vector<FuncPtr>& outputs, const Target& target) {
  if (!listener && !handler_of_process()) return;
  const bool with_hidden = has_warning_scope();
  for (const std::string& warning : warnings_of(outputs, with_hidden, target))
    tell_warning(warning);
}

void warn_of_hidden_definitions(const FuncContents& f) {
  const WarningHandler tell = listener ? WarningHandler() : handler_of_process();
  if (!tell || !overwrites_all(f, f.updates.back())) return;
  std::vector<std::string> messages;
  Findings(messages).find_hidden(f);
  for (const std::string& message : messages) tell(message);
}

}  // namespace retrograde::frontend

namespace retrograde {

std::vector<std::string> warnings_of(const Pipeline& pipeline) {
  return frontend::warnings_of(pipeline.spec().outputs);
}

WarningHandler set_warning_handler(WarningHandler handler) {
  std::lock_guard lock(frontend::process_handler().mutex);
  return std::exchange(frontend::process_handler().tell, std::move(handler));
}

WarningScope::WarningScope(std::function<void(const std::string&)> tell)
    : tell_(std::move(tell)), outer_(std::exchange(frontend::listener, tell_)) {}
WarningScope::~WarningScope() { frontend::listener = std::move(outer_); }

}  // namespace retrograde
