#include "driver/plan_schedule.h"

#include <algorithm>

#include "autoschedule/rewrites/rewrites.h"
#include "diagnostics/error.h"
#include "driver/chosen_places.h"
#include "graph/definitions/parameter_contents.h"
#include "graph/directives/give_directive.h"

namespace retrograde::driver {

namespace {

constexpr double allowed_times = 2;  // the largest Func of the primal, by default

// Bytes of a call, without what the program allocates itself.
class CallMemory {
 public:
  CallMemory(const std::vector<FuncPtr>& outputs, const ScheduleRequest& request)
      : accesses_(outputs), sizes_(accesses_, {planning::unknown_extent}), request_(request) {}

  planning::AccessGraph take_accesses() && { return std::move(accesses_); }
  double callers_bytes() const {
    double result = 0;
    for (size_t i = 0; i < accesses_.images().size(); ++i) {
      const auto& image = accesses_.images()[i];
      result +=
          image->type.bytes() * elements(static_cast<size_t>(image->dimensions), [&](size_t d) {
            return sizes_.of_image(static_cast<planning::ImageId>(i), d);
          });
    }
    for (const planning::FuncNode& node : accesses_.funcs()) {
      if (node.is_output) result += bytes_of(node);
    }
    return result;
  }
  double budget() const {
    if (request_.options.memory_budget > 0)
      return static_cast<double>(request_.options.memory_budget);
    double largest = 0;
    for (const planning::FuncNode& node : accesses_.funcs()) {
      if (!node.func->made && !node.is_output) largest = std::max(largest, bytes_of(node));
    }
    return callers_bytes() + std::max(allowed_times * largest,
                                      static_cast<double>(request_.machine.last_cache_bytes()));
  }

 private:
  planning::AccessGraph accesses_;
  const planning::SizeModel sizes_;
  const ScheduleRequest& request_;

  template <typename ExtentOf>
  static double elements(size_t dimensions, const ExtentOf& extent_of) {
    double result = 1;
    for (size_t d = 0; d < dimensions; ++d) {
      const planning::Extent extent = extent_of(d);
      result *= extent.is_known() ? static_cast<double>(extent.estimate) : 0;
    }
    return result;
  }
  double bytes_of(const planning::FuncNode& node) const {
    const graph::FuncContents& f = *node.func;
    return graph::total_bytes(f.types) *
           elements(f.args.size(), [&](size_t d) { return sizes_.of(accesses_.find(&f), d); });
  }
};

// No plan can say so.
void compute_extern_stages_at_root(const std::vector<FuncPtr>& outputs) {
  for (const FuncPtr& f : graph::topological_order(outputs)) {
    if (f->is_extern() && !graph::has_directives(*f))
      graph::give_directive({f}, graph::ComputeAt{{{graph::LoopLevel::Kind::Root, "", "", -1}}});
  }
}

}  // namespace

PlannedSchedules::PlannedSchedules(const std::vector<FuncPtr>& outputs,
                                   const ScheduleRequest& request, Scheduling what, int width) {
  const AutoscheduleOptions& options = request.options;
  check_chosen_places(outputs, options);
  planning::RewriteOptions rewrites;
  rewrites.splits_sums = request.makes(Decision::CutReductions);
  rewrites.copies_operands = request.makes(Decision::LayoutStaging);
  const planning::Device* device = request.on_gpu ? &request.device : nullptr;
  const bool adds_at_places = request.makes(Decision::ScatterStrategy);
  rewrites.for_device = {device, rewrites.splits_sums, adds_at_places, atomics_of(options)};
  rewrites.kept = kept_names(outputs, options, what);
  CallMemory memory(outputs, request);
  callers_bytes_ = memory.callers_bytes();
  budget_bytes_ = memory.budget();
  planning::AccessGraph accesses = std::move(memory).take_accesses();
  PlanSearchOptions search;
  search.width = width;
  search.spare_bytes = static_cast<int64_t>(std::max(budget_bytes_ - callers_bytes_, 0.0));
  search.must_fit = options.memory_budget > 0;
  search.threads = options.threads;
  search.what = what;
  search.device = device;
  const std::vector<FuncPtr> rewritten = planning::with_rewrites(outputs, rewrites, accesses);
  compute_extern_stages_at_root(rewritten);
  search.accesses = &accesses;
  search_ = search_plans(rewritten, outputs, options, request.machine, search);
}

ScheduledGraph PlannedSchedules::scheduled(const planning::FoundPlan& plan) const {
  const auto bytes = static_cast<int64_t>(callers_bytes_ + plan.cost.peak_bytes);
  return {search_.emitted(plan), MemoryUse{bytes, static_cast<int64_t>(budget_bytes_)}};
}

ScheduledGraph PlannedSchedules::best() const {
  // Directives prove less than moves know: the order of the steps of a recurrence, for one.
  for (const planning::FoundPlan& plan : result().found) {
    try {
      return scheduled(plan);
    } catch (const Error&) {
      continue;
    }
  }
  return scheduled(result().start);
}

ScheduledGraph schedule_by_plan(const std::vector<FuncPtr>& outputs, const ScheduleRequest& request,
                                Scheduling what) {
  return PlannedSchedules(outputs, request, what).best();
}

}  // namespace retrograde::driver
