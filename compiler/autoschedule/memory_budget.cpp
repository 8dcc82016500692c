#include "autoschedule/memory_budget.h"

#include <HalideRuntime.h>

#include <algorithm>
#include <limits>
#include <set>
#include <string>
#include <unordered_map>

#include "autoschedule/cost_estimate.h"
#include "autoschedule/invariant_factors.h"
#include "autoschedule/machine/reference.h"
#include "autoschedule/memory_estimate.h"
#include "autoschedule/placement_limits.h"
#include "autoschedule/stored_funcs.h"
#include "autoschedule/task_sizes.h"
#include "graph/copy_graph.h"
#include "graph/definitions/first_reads.h"
#include "graph/definitions/parameter_contents.h"
#include "graph/directives/give_directive.h"
#include "ir/build.h"

namespace retrograde::autoschedule {

namespace {

constexpr size_t most_rounds = 8;     // schedules that are tried
constexpr size_t most_funcs = 800;    // in all of these together: compiling is to take no longer
constexpr int64_t allowed_times = 2;  // the largest Func of the primal, by default
// Operations done again for a value that is not stored, by default: so many ways to memory.
constexpr double worth_ways = 8;
constexpr double worth_share = 0.9;  // of the bytes before, at most

bool is_among(const FuncPtr& f, const std::vector<FuncPtr>& some) {
  return std::find(some.begin(), some.end(), f) != some.end();
}

int64_t bytes_of_image(const ParameterContents& p) {
  int64_t bytes = p.type.bytes();
  for (int d = 0; d < p.dimensions; ++d) {
    const auto dimension = static_cast<size_t>(d);
    std::optional<int64_t> extent;
    if (p.buffer) {
      extent = p.buffer->dim[d].extent;
    } else if (dimension < p.constraints.size()) {
      const BufferConstraint& c = p.constraints[dimension];
      const Expr& told = c.extent.defined() ? c.extent : c.extent_estimate;
      if (told.defined()) extent = as_const_int(told);
    }
    bytes *= extent.value_or(0);
  }
  return bytes;
}

class BudgetedSchedule {
 public:
  BudgetedSchedule(const std::vector<FuncPtr>& outputs, const ScheduleRequest& request,
                   Scheduling what)
      : outputs_(outputs), request_(request), what_(what) {
    for (const auto& p : parameters_of(outputs)) inputs_ += p->is_buffer ? bytes_of_image(*p) : 0;
  }

  ScheduledGraph choose() {
    Attempt best = attempt(request_.recomputed);
    if (!fits(best) && may_add_atomically()) {
      request_.atomic_parts = true;
      Attempt other = attempt(request_.recomputed);
      if (is_worth(other, best))
        best = std::move(other);
      else
        request_.atomic_parts = false;
    }
    std::set<std::string> refused;
    for (size_t rounds = rounds_of(best); rounds > 0 && !fits(best); --rounds) {
      const std::set<std::string> more = to_recompute(best, refused);
      if (more.empty()) break;
      std::set<std::string> recomputed = best.recomputed;
      recomputed.insert(more.begin(), more.end());
      Attempt next = attempt(recomputed);
      if (is_worth(next, best))
        best = std::move(next);
      else
        refused.insert(more.begin(), more.end());
    }
    return best.graph;
  }

 private:
  struct Attempt {
    ScheduledGraph graph;
    MemoryEstimate estimate;
    std::set<std::string> recomputed;
  };
  // A few bytes less are not worth operations that nobody asked for.
  bool is_worth(const Attempt& next, const Attempt& best) const {
    const double least = request_.options.memory_budget > 0 ? 1 : worth_share;
    return static_cast<double>(next.graph.memory.bytes) <
           least * static_cast<double>(best.graph.memory.bytes);
  }
  size_t rounds_of(const Attempt& first) const {
    if (fits(first)) return 0;
    const size_t affordable = most_funcs / topological_order(outputs_).size();
    const size_t least = request_.options.memory_budget > 0 ? 2 : 0;
    return std::clamp(affordable, least, most_rounds);
  }
  static bool fits(const Attempt& a) { return a.graph.memory.bytes <= a.graph.memory.budget_bytes; }

  Attempt attempt(const std::set<std::string>& recomputed) const {
    ScheduleRequest request = request_;
    request.recomputed = recomputed;
    Attempt result{{copy_graph(outputs_).outputs, {}}, {}, recomputed};
    const std::vector<FuncPtr>& outputs = result.graph.outputs;
    const SizeEstimate sizes = give_default_schedule(outputs, request, what_);
    result.estimate = estimate_memory(outputs, sizes, threads());
    int64_t callers = inputs_;
    for (const FuncPtr& f : outputs) callers += sizes.bytes(*f);
    result.graph.memory = {callers + result.estimate.peak_bytes, budget(outputs, callers, sizes)};
    return result;
  }

  int64_t threads() const {
    const int said = threads_of(request_);
    return said > 0 ? said : planning::reference_threads;
  }

  int64_t budget(const std::vector<FuncPtr>& outputs, int64_t callers,
                 const SizeEstimate& sizes) const {
    if (request_.options.memory_budget > 0) return request_.options.memory_budget;
    int64_t largest = 0;
    for (const FuncPtr& f : topological_order(outputs)) {
      if (!f->made && !is_among(f, outputs)) largest = std::max(largest, sizes.bytes(*f));
    }
    return callers + std::max(allowed_times * largest, sizes.machine().last_cache_bytes());
  }

  // What brings a schedule down to the budget, if that is enough; none that was refused. One after the other: what is
  // computed where it is read makes what it reads in turn more expensive to compute again.
  std::set<std::string> to_recompute(const Attempt& attempt,
                                     const std::set<std::string>& refused) const {
    ChosenPlaces chosen;
    chosen.recomputed = with_names(outputs_, attempt.recomputed);
    const auto candidates = by_name();
    int64_t excess = attempt.graph.memory.bytes - attempt.graph.memory.budget_bytes;
    std::set<std::string> result;
    while (excess > 0) {
      const auto uses = uses_of_stored(outputs_, chosen);
      double least = std::numeric_limits<double>::infinity();  // operations for each byte
      const MemoryEstimate::Part* best = nullptr;
      for (const MemoryEstimate::Part& part : attempt.estimate.at_peak) {
        const std::string& name = part.func->name;
        const auto found = candidates.find(name);
        if (found == candidates.end() || refused.contains(name) || result.contains(name)) continue;
        const StorageUse& use = uses.at(found->second.get());
        const double again = std::max(0.0, use.reads_in_all - 1) * use.operations;
        const double for_a_byte = again / std::max(1, total_bytes(part.func->types));
        const bool is_allowed = request_.options.memory_budget > 0 ||
                                again <= worth_ways * planning::memory_trip_operations;
        if (!is_allowed || for_a_byte >= least) continue;
        least = for_a_byte;
        best = &part;
      }
      if (!best) break;
      result.insert(best->func->name);
      chosen.recomputed.insert(candidates.at(best->func->name).get());
      excess -= best->bytes;
    }
    return result;
  }

  // Funcs that may be computed where they are read, of the graph without a schedule.
  std::unordered_map<std::string, FuncPtr> by_name() const {
    const std::vector<FuncPtr> order = topological_order(outputs_);
    const PlacementLimits limits = placement_limits(order);
    std::unordered_map<std::string, FuncPtr> result;
    for (const FuncPtr& f : order) {
      const bool may_move = f->is_pure() && !has_directives(*f) && !is_among(f, outputs_) &&
                            !limits.need_root.contains(f.get()) &&
                            !limits.levels.contains(f.get()) && !is_invariant_factor(*f);
      const auto is_it = [&](const FuncName& named) { return named.name == f->name; };
      if (may_move && std::ranges::none_of(request_.options.store, is_it)) result[f->name] = f;
    }
    return result;
  }

  // It takes about three times as long: for a budget that somebody gave.
  bool may_add_atomically() const {
    return !request_.options.deterministic && request_.options.memory_budget > 0;
  }

  const std::vector<FuncPtr>& outputs_;
  ScheduleRequest request_;
  const Scheduling what_;
  int64_t inputs_ = 0;
};

}  // namespace

ScheduledGraph schedule_within_budget(const std::vector<FuncPtr>& outputs,
                                      const ScheduleRequest& request, Scheduling what) {
  const graph::FirstReadsMemo memo;
  return BudgetedSchedule(outputs, request, what).choose();
}

}  // namespace retrograde::autoschedule
