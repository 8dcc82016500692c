#include "driver/choose_schedule.h"

#include <algorithm>
#include <optional>

#include "autoschedule/machine/kept_machine.h"
#include "diagnostics/error.h"
#include "driver/plan_schedule.h"
#include "driver/schedule_difference.h"
#include "graph/definitions/parameter_contents.h"
#include "graph/directives/give_directive.h"
#include "graph/directives/schedule_log.h"
#include "ir/build.h"
#include "lower/lower.h"
#include "simplify/simplify.h"
#include "transform/size_estimate.h"
#include "tuning/predict.h"

namespace retrograde::driver {

using planning::FoundPlan;

namespace {

constexpr int wide = 4;  // the beam of a search that was asked for
// A plan is taken if the prediction of its lowered program is less than this part of that of the default.
constexpr double confirmed = 0.97;

// The machine of a wide search: that of the cost model, with the threads of the options.
planning::Machine search_machine(const AutoscheduleOptions& options, const Target& target) {
  planning::Machine machine = planning::machine_for(target);
  if (options.threads > 0) machine.threads = options.threads;
  return machine;
}

std::string words_for(const std::vector<FuncPtr>& outputs) {
  return listed(outputs, [](const FuncPtr& f) { return quoted(f->name); });
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
  const transform::SizeEstimate sizes(outputs);
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
    return note_against_search(outputs, "a wide search predicts times of processors",
                               "the target has a GPU",
                               "Search for a target without one, or leave the search out");
  }
  const std::vector<FuncPtr> order = topological_order(outputs);
  const auto is_left = [](const FuncPtr& f) { return !f->is_extern() && !has_directives(*f); };
  if (std::ranges::none_of(order, is_left)) {
    return note_against_search(outputs, "a search is for what nobody scheduled",
                               "every Func has a directive",
                               "Search before anything else schedules them");
  }
  const std::string unknown = unknown_size(outputs);
  if (unknown.empty()) return "";
  return note_against_search(outputs, "sizes of images and outputs are known or estimated", unknown,
                             "Give set_estimates() or bind the image");
}

double milliseconds(double seconds) { return 1e3 * seconds; }

// A schedule with its prediction. That of the lowered program knows borders and guards as they are.
struct Lowered {
  ScheduledGraph graph;
  ir::LoweredFunction function;
  double seconds = 0;
};

// The default schedule and those of a wide search, with the figures of one machine.
class WideSearch {
 public:
  WideSearch(const std::vector<FuncPtr>& outputs, const ScheduleRequest& request, Scheduling what,
             const Lowering& lowering)
      : lowering_(lowering), machine_(search_machine(request.options, lowering.target)) {
    ScheduleRequest wider = request;
    wider.machine = machine_;
    found_.emplace(outputs, wider, what, wide);
  }

  // The best plan that the lowered program confirms, or else the default schedule, with a report about it and the one that
  // comes next. `is_wanted`: otherwise the default schedule is taken.
  ChosenSchedule choose(ScheduledGraph by_default, bool is_wanted) const {
    const Lowered of_default = lowered(std::move(by_default));
    std::optional<Lowered> taken, other;
    for (const FoundPlan& plan : found_->result().found) {
      if (taken && other) break;
      std::optional<Lowered> candidate = lowered_if_it_can_be(plan);
      if (!candidate || is_same(*candidate, of_default)) continue;
      const bool is_better =
          is_wanted && !taken && candidate->seconds < confirmed * of_default.seconds;
      (is_better ? taken : other) = std::move(candidate);
    }
    if (taken && !other) other = of_default;
    const Lowered& chosen = taken ? *taken : of_default;
    ChosenSchedule result{chosen.graph, {}, chosen.function};
    result.search.tried = static_cast<size_t>(found_->result().priced);
    result.search.default_ms = milliseconds(of_default.seconds);
    result.search.predicted_ms = milliseconds(chosen.seconds);
    if (other) {
      result.search.runner_up_ms = milliseconds(other->seconds);
      result.search.runner_up = difference_of(graph::schedule_log(chosen.graph.outputs),
                                              graph::schedule_log(other->graph.outputs));
    }
    return result;
  }

 private:
  const Lowering& lowering_;
  const planning::Machine machine_;
  std::optional<PlannedSchedules> found_;

  static bool is_same(const Lowered& a, const Lowered& b) {
    return difference_of(graph::schedule_log(a.graph.outputs), graph::schedule_log(b.graph.outputs))
        .empty();
  }
  Lowered lowered(ScheduledGraph graph) const {
    Lowered result{std::move(graph), {}};
    const std::vector<FuncPtr>& outputs = result.graph.outputs;
    result.function = lowering_.lower(outputs);
    const auto sizes = tuning::program_sizes(result.function, tuning::output_shapes(outputs));
    result.seconds = tuning::predicted_seconds(result.function, sizes, machine_, machine_.threads);
    return result;
  }
  std::optional<Lowered> lowered_if_it_can_be(const FoundPlan& plan) const {
    try {
      return lowered(found_->scheduled(plan));
    } catch (const Error&) {
      return std::nullopt;
    }
  }
};

}  // namespace

ir::LoweredFunction Lowering::lower(const std::vector<FuncPtr>& scheduled) const {
  lower::LowerOptions options;
  options.target = target;
  return lower::lower(name, scheduled, inputs ? *inputs : lower::infer_arguments(scheduled),
                      options);
}

// "cannot ..." as errors say it, though nothing fails.
std::string note_against_search(const std::vector<FuncPtr>& outputs, const std::string& rule,
                                const std::string& evidence, const std::string& instead) {
  return Message{"search for a schedule of " + words_for(outputs), rule,
                 evidence + ", so that the default schedule is taken", instead}
      .render();
}

ChosenSchedule choose_schedule(const std::vector<FuncPtr>& outputs, const ScheduleRequest& request,
                               Scheduling what, const Lowering& lowering, Choosing choosing) {
  const bool is_wide = request.options.search;
  ScheduledGraph by_default = schedule_by_plan(outputs, request, what);
  if (!is_wide && choosing == Choosing::Schedule) return {std::move(by_default), {}, {}};
  const std::string reason = reason_against(outputs, request);
  if (!reason.empty()) {
    ChosenSchedule result{std::move(by_default), {}, {}};
    result.search.note = reason;
    return result;
  }
  return WideSearch(outputs, request, what, lowering).choose(std::move(by_default), is_wide);
}

}  // namespace retrograde::driver
