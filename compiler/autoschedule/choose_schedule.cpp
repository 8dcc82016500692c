#include "autoschedule/choose_schedule.h"

#include <HalideRuntime.h>

#include <algorithm>
#include <optional>

#include "autoschedule/graph_rewrites.h"
#include "autoschedule/keep_graph.h"
#include "autoschedule/schedule_search.h"
#include "autoschedule/stored_funcs.h"
#include "autoschedule/task_sizes.h"
#include "diagnostics/error.h"
#include "diagnostics/large_stack.h"
#include "graph/definitions/parameter_contents.h"
#include "graph/directives/give_directive.h"
#include "graph/directives/wrappers.h"
#include "ir/build.h"
#include "simplify/simplify.h"

namespace retrograde::autoschedule {

namespace {

constexpr double worth_leaving = 0.95;  // of the time that the rules' schedule is predicted to take

std::string words_for(const std::vector<FuncPtr>& outputs) {
  return listed(outputs, [](const FuncPtr& f) { return quoted(f->name); });
}

// "cannot ..." as errors say it, though nothing fails.
std::string note_of(const std::vector<FuncPtr>& outputs, const std::string& rule,
                    const std::string& evidence, const std::string& instead) {
  return Message{"search for a schedule of " + words_for(outputs), rule,
                 evidence + ", so that what the rules choose is taken", instead}
      .render();
}

// The size of an image or of an output that nobody told; empty: all are known.
std::string unknown_size(const std::vector<FuncPtr>& outputs) {
  const auto says = [](const Expr& e) { return e.defined() && as_const_int(simplify(e)); };
  for (const auto& p : parameters_of(outputs)) {
    for (size_t d = 0; p->is_buffer && !p->buffer && d < static_cast<size_t>(p->dimensions); ++d) {
      const BufferConstraint c = d < p->constraints.size() ? p->constraints[d] : BufferConstraint();
      if (!says(c.extent) && !says(c.extent_estimate))
        return text("the extent of dimension ", d, " of ", quoted(p->name), " is not known");
    }
  }
  const SizeEstimate sizes(outputs);
  for (const FuncPtr& f : outputs) {
    for (size_t d = 0; d < f->args.size(); ++d) {
      if (!sizes.extent(*f, d))
        return text("the extent of ", quoted(f->args[d]), " of ", quoted(f->name), " is not known");
    }
  }
  return "";
}

// Why there is nothing to search; empty: there is.
std::string reason_against(const std::vector<FuncPtr>& outputs, const ScheduleRequest& request) {
  if (request.on_gpu) {
    return note_of(outputs, "a search predicts times of processors", "the target has a GPU",
                   "Search for a target without one, or leave the search out");
  }
  const std::vector<FuncPtr> order = topological_order(outputs);
  const auto is_left = [](const FuncPtr& f) { return !f->is_extern() && !has_directives(*f); };
  if (std::ranges::none_of(order, is_left)) {
    return note_of(outputs, "a search is for what nobody scheduled", "every Func has a directive",
                   "Search before anything else schedules them");
  }
  const std::string unknown = unknown_size(outputs);
  if (unknown.empty()) return "";
  return note_of(outputs, "sizes of images and outputs are known or estimated", unknown,
                 "Give set_estimates() or bind the image");
}

double milliseconds(double seconds) { return 1e3 * seconds; }

ChosenSchedule chosen_of(ScheduleSearch found, bool may_leave_rules) {
  const bool is_of_rules = found.best.cost == found.cost_of_rules;  // the first of equals
  const bool takes_best =
      is_of_rules || (may_leave_rules && found.best.cost < worth_leaving * found.cost_of_rules);
  const SearchedSchedule& taken = takes_best ? found.best : found.rules;
  const SearchedSchedule& other = takes_best ? found.runner_up : found.best;
  ChosenSchedule result{taken.graph, {}};
  result.search.tried = found.tried;
  result.search.rules_ms = milliseconds(found.cost_of_rules);
  result.search.predicted_ms = milliseconds(taken.cost);
  if (!other.graph.outputs.empty()) {
    result.search.runner_up_ms = milliseconds(other.cost);
    result.search.runner_up = difference_of(graph::schedule_log(taken.graph.outputs),
                                            graph::schedule_log(other.graph.outputs));
  }
  return result;
}

}  // namespace

ChosenSchedule choose_schedule(const std::vector<FuncPtr>& outputs, const ScheduleRequest& request,
                               Scheduling what, const Target& target, bool wants_runner_up) {
  const auto by_rules = [&](const std::string& note) {
    ChosenSchedule result{schedule_within_budget(outputs, request, what), {}};
    result.search.note = note;
    return result;
  };
  if (!request.options.search && !wants_runner_up) return by_rules("");
  if (const std::string reason = reason_against(outputs, request); !reason.empty())
    return by_rules(reason);
  const auto cost = [&](const std::vector<FuncPtr>& scheduled) {
    return predicted_seconds(scheduled, target, threads_of(request));
  };
  try {
    return chosen_of(search_schedule(outputs, request, what, cost), request.options.search);
  } catch (const Error& error) {  // of the rules' own: lowering says so where it matters
    return by_rules(note_of(outputs, "the schedule of the rules can be lowered", error.what(),
                            "Correct the program or its schedule"));
  }
}

ChosenSchedule choose_schedule(const PipelineSpec& pipeline, const Target& target,
                               bool wants_runner_up) {
  const ScheduleRequest request = request_for(target, pipeline.autoschedule);
  keep_graph(pipeline.name, pipeline.outputs);
  ChosenSchedule result;
  if (!request.options.search && !wants_runner_up) {
    result.graph.outputs = schedule_unscheduled(pipeline.outputs, request.machine, request.options);
    return result;
  }
  run_on_large_stack([&] {
    const std::vector<FuncPtr> wrapped = apply_wrappers(pipeline.outputs);
    if (is_differentiated(wrapped)) {
      result = choose_schedule(with_graph_rewrites(wrapped, /*on_gpu=*/false), request,
                               Scheduling::Gradients, target, wants_runner_up);
      return;
    }
    result.graph.outputs = schedule_unscheduled(pipeline.outputs, request.machine, request.options);
    result.search.note =
        note_of(wrapped, "compiling searches schedules of gradients", "none of its Funcs is one",
                "Call auto_schedule() with these options");
  });
  return result;
}

}  // namespace retrograde::autoschedule
