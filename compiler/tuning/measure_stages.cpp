#include "tuning/measure_stages.h"

#include <HalideRuntime.h>

#include <algorithm>
#include <chrono>
#include <limits>

#include "frontend/run/call.h"
#include "ir/visit.h"
#include "jit/jit.h"
#include "lower/lower.h"
#include "retrograde_runtime.h"
#include "tuning/compiled_once.h"

namespace retrograde::tuning {

namespace {

using Clock = std::chrono::steady_clock;
constexpr int fewest_runs = 5;

double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

// Keeps the profiler's thread between runs, which else start and end it each.
class ProfilerSession {
 public:
  explicit ProfilerSession(const std::string& name)
      : run_(retrograde_profiler_begin(nullptr, name.c_str(), "overhead")) {}
  ProfilerSession(const ProfilerSession&) = delete;
  ProfilerSession& operator=(const ProfilerSession&) = delete;
  ~ProfilerSession() { retrograde_profiler_end(nullptr, run_); }

 private:
  void* run_;
};

}  // namespace

MeasuredStages measure_stages(const PipelineSpec& pipeline,
                              const std::vector<graph::FuncPtr>& scheduled,
                              const std::vector<halide_buffer_t*>& outputs, const Target& target,
                              const ExplainOptions& options, const JITHandlers& handlers) {
  // A name of its own keeps what it finds apart from what else runs under the profiler.
  const std::string name = ir::unique_name(pipeline.name + "_explained");
  lower::LowerOptions lowering;
  lowering.target = target.with_feature(Target::Profile);
  const ir::LoweredFunction function =
      lower::lower(name, scheduled, lower::infer_arguments(pipeline.outputs), lowering);
  const CompiledOnce code(function, lowering.target, pipeline.externs);
  const std::string asked = "measure the stages of " + retrograde::quoted(pipeline.name);
  frontend::Arguments arguments(code, outputs, false, asked, ParamMap::empty_map());
  JITHandlers used = handlers;
  if (options.threads > 0) used.thread_limit = options.threads;
  const auto call = [&] {
    const auto begin = Clock::now();
    frontend::call(code, used, arguments.argv(), asked, nullptr);
    return seconds_since(begin);
  };
  MeasuredStages result;
  result.total_seconds = std::numeric_limits<double>::infinity();
  const ProfilerSession session(name + "_runs");
  const auto begin = Clock::now();
  int runs = 0;
  for (; runs < fewest_runs || seconds_since(begin) < options.seconds; runs++)
    result.total_seconds = std::min(result.total_seconds, call());
  const halide_profiler_pipeline_stats* stats = retrograde_profiler_pipeline(name.c_str());
  if (!stats || stats->time == 0) return result;
  result.sampled_seconds = 1e-9 * static_cast<double>(stats->time);
  result.peak_bytes = static_cast<double>(stats->memory_peak);
  // The shares are of all runs, the time is that of the fastest.
  for (int i = 0; i < stats->num_funcs; i++) {
    const double share =
        static_cast<double>(stats->funcs[i].time) / static_cast<double>(stats->time);
    result.seconds[stats->funcs[i].name] += share * result.total_seconds;
  }
  return result;
}

}  // namespace retrograde::tuning
