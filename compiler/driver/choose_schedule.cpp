#include "driver/choose_schedule.h"

#include <algorithm>
#include <optional>

#include "autoschedule/size_estimate.h"
#include "diagnostics/error.h"
#include "driver/plan_schedule.h"
#include "driver/plan_search.h"
#include "driver/schedule_difference.h"
#include "graph/definitions/parameter_contents.h"
#include "graph/directives/give_directive.h"
#include "graph/directives/schedule_log.h"
#include "ir/build.h"
#include "lower/lower.h"
#include "simplify/simplify.h"
#include "tuning/predict.h"

namespace retrograde::driver {

using autoschedule::ScheduleRequest;
using autoschedule::Scheduling;
using planning::FoundPlan;

namespace {

constexpr int wide = 4;  // the beam of a search that was asked for
// A plan is taken if its cost is less than this part of the cost of the rules' plan, and the prediction of the lowered
// program less than that part of theirs.
constexpr double worth_leaving = 0.8, confirmed = 0.95;

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
  const autoschedule::SizeEstimate sizes(outputs);
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
  std::vector<FuncPtr> outputs;
  ir::LoweredFunction function;
  double seconds = 0;
  double peak_bytes = 0;
};

// The search's plans by their cost.
class Choice {
 public:
  Choice(const PlanSearch& found, const Lowering& lowering, const planning::Machine& machine)
      : found_(found), lowering_(lowering), machine_(machine) {}

  // The first plan that is clearly faster, which the lowered program confirms.
  ChosenSchedule take(ChosenSchedule rules) const {
    std::optional<Lowered> of_rules;
    for (const FoundPlan& plan : found_.result.found) {
      if (!is_clearly_faster(plan)) break;
      std::optional<Lowered> candidate = lowered_if_it_can_be(plan);
      if (!candidate) continue;
      if (!of_rules) of_rules = lowered(found_.result.start);
      if (is_confirmed(*candidate, *of_rules)) return with(std::move(rules), *candidate);
    }
    return of_rules ? with(std::move(rules), *of_rules) : rules;
  }

  // The same with a report about the plan that comes next.
  ChosenSchedule with_report(ChosenSchedule rules) const {
    const planning::SearchResult& result = found_.result;
    const Lowered of_rules = lowered(result.start);
    std::optional<Lowered> taken, other;
    for (const FoundPlan& plan : result.found) {
      if (plan.plan == result.start.plan || (taken && other)) continue;
      std::optional<Lowered> candidate = lowered_if_it_can_be(plan);
      if (!candidate) continue;
      const bool is_faster = is_clearly_faster(plan) && is_confirmed(*candidate, of_rules);
      (is_faster && !taken ? taken : other) = std::move(candidate);
    }
    if (taken && !other) other = of_rules;
    const Lowered& chosen = taken ? *taken : of_rules;
    rules.search.tried = static_cast<size_t>(result.priced);
    rules.search.rules_ms = milliseconds(of_rules.seconds);
    rules.search.predicted_ms = milliseconds(chosen.seconds);
    if (other) {
      rules.search.runner_up_ms = milliseconds(other->seconds);
      rules.search.runner_up =
          difference_of(graph::schedule_log(chosen.outputs), graph::schedule_log(other->outputs));
    }
    return with(std::move(rules), chosen);
  }

 private:
  const PlanSearch& found_;
  const Lowering& lowering_;
  const planning::Machine& machine_;

  bool is_clearly_faster(const FoundPlan& plan) const {
    return plan.cost.seconds < worth_leaving * found_.result.start.cost.seconds;
  }
  static bool is_confirmed(const Lowered& plan, const Lowered& rules) {
    return plan.seconds < confirmed * rules.seconds;
  }
  ChosenSchedule with(ChosenSchedule schedule, const Lowered& chosen) const {
    const double more = chosen.peak_bytes - found_.result.start.cost.peak_bytes;
    schedule.graph.memory.bytes += static_cast<int64_t>(more);
    schedule.graph.outputs = chosen.outputs;
    schedule.lowered = chosen.function;
    return schedule;
  }
  Lowered lowered(const FoundPlan& plan) const {
    Lowered result{found_.emitted(plan), {}};
    result.peak_bytes = plan.cost.peak_bytes;
    result.function = lowering_.lower(result.outputs);
    const auto sizes =
        tuning::program_sizes(result.function, tuning::output_shapes(result.outputs));
    result.seconds = tuning::predicted_seconds(result.function, sizes, machine_, machine_.threads);
    return result;
  }
  std::optional<Lowered> lowered_if_it_can_be(const FoundPlan& plan) const {
    try {
      return lowered(plan);
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
  const bool wants_report = is_wide || choosing == Choosing::SearchWithReport;
  const bool of_plans = default_schedules == DefaultSchedules::OfPlans &&
                        choosing == Choosing::Search && !wants_report;
  if (request.on_gpu || of_plans) {
    ChosenSchedule result{schedule_by_plan(outputs, request, what), {}, {}};
    if (wants_report) result.search.note = reason_against(outputs, request);
    return result;
  }
  ChosenSchedule rules{autoschedule::schedule_within_budget(outputs, request, what), {}, {}};
  if (choosing == Choosing::Rules && !is_wide) return rules;
  const std::string reason = reason_against(outputs, request);
  if (wants_report) rules.search.note = reason;
  if (!reason.empty()) return rules;
  const autoschedule::MemoryUse& memory = rules.graph.memory;
  PlanSearchOptions options;
  options.spare_bytes = std::max<int64_t>(memory.budget_bytes - memory.bytes, 0);
  if (is_wide) options.width = wide;
  options.start = is_wide ? SearchStart::Both : SearchStart::NothingBesideRules;
  options.what = what;
  const planning::Machine machine = is_wide ? search_machine(request.options, lowering.target)
                                            : autoschedule::machine_of(request);
  try {
    const PlanSearch found =
        search_plans(rules.graph.outputs, outputs, request.options, machine, options);
    const Choice choice(found, lowering, machine);
    return wants_report ? choice.with_report(rules) : choice.take(rules);
  } catch (const Error& error) {  // lowering the rules' schedule says so where it matters
    if (wants_report) {
      rules.search.note = note_against_search(outputs, "the schedule of the rules can be lowered",
                                              error.what(), "Correct the program or its schedule");
    }
  }
  return rules;
}

}  // namespace retrograde::driver
