#include "tune_program.h"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <ostream>
#include <set>
#include <system_error>
#include <thread>

#include "autoschedule/machine/kept_machine.h"
#include "diagnostics/error.h"
#include "diagnostics/large_stack.h"
#include "driver/plan_schedule.h"
#include "driver/schedule_difference.h"
#include "graph/directives/wrappers.h"
#include "graph/graph.h"
#include "tuning/measure_schedule.h"

namespace retrograde::tune {

namespace {

using graph::FuncPtr;
using Clock = std::chrono::steady_clock;
constexpr double warm_up = 4;   // times a schedule's run time, before the first measurement
constexpr double hopeless = 3;  // times the best time: not worth a second run
constexpr int most_candidates = 32;

struct Candidate {
  std::vector<FuncPtr> outputs;
  std::string log;  // with names that are the same in each run
  double predicted_seconds = 0;
};

// The default schedule first, then what a wide search over moves finds, by predicted time.
std::vector<Candidate> find_candidates(const std::vector<FuncPtr>& outputs, const Target& target,
                                       int threads) {
  std::set<std::string> known;  // names of the unscheduled graph
  for (const FuncPtr& f : graph::topological_order(outputs)) known.insert(f->name);
  AutoscheduleOptions options;
  options.threads = threads;
  driver::ScheduleRequest request = driver::request_for(target, options);
  std::vector<Candidate> candidates;
  const auto add = [&](const driver::PlannedSchedules& schedules,
                       const planning::FoundPlan& found) {
    try {
      std::vector<FuncPtr> scheduled = schedules.scheduled(found).outputs;
      std::string log = driver::with_stable_names(graph::schedule_log(scheduled), known);
      const auto is_it = [&](const Candidate& other) { return other.log == log; };
      if (std::ranges::none_of(candidates, is_it))
        candidates.push_back({std::move(scheduled), std::move(log), found.cost.seconds});
    } catch (const Error&) {  // directives cannot say it
    }
  };
  const auto search = [&](int width) {
    return driver::PlannedSchedules(outputs, request, driver::Scheduling::Everything, width);
  };
  const driver::PlannedSchedules by_default = search(1);
  add(by_default, by_default.result().found.front());
  request.machine = planning::machine_for(target);
  request.machine.threads = threads;
  const driver::PlannedSchedules wide = search(most_candidates);
  for (const planning::FoundPlan& found : wide.result().found) add(wide, found);
  return candidates;
}

Measurement measure(const Candidate& candidate, const Target& target, const Options& options,
                    double best_seconds) {
  Measurement result;
  result.predicted_seconds = candidate.predicted_seconds;
  try {
    tuning::MeasureOptions measuring;
    measuring.seconds = options.run_seconds;
    measuring.threads = options.threads;
    measuring.hopeless_seconds = best_seconds * hopeless;
    const auto measured = tuning::measure_schedule(candidate.outputs, target, measuring);
    result.seconds = measured.seconds;
    result.runs = measured.runs;
  } catch (const Error& error) {
    result.error = error.what();
  }
  return result;
}

// Makes the folder where there is none.
void write_file(const std::string& path, const std::string& contents) {
  std::error_code ignored;  // the file says so if the folder cannot be made
  std::filesystem::create_directories(std::filesystem::path(path).parent_path(), ignored);
  std::ofstream file(path);
  file << contents;
  if (file.flush()) return;
  user_error("write " + retrograde::quoted(path), "the file must be writable", "writing it failed",
             "Name another folder");
}

std::string in_milliseconds(double seconds) {
  std::ostringstream out;
  out << std::fixed << std::setprecision(seconds < 1e-3 ? 4 : 2) << 1e3 * seconds << " ms";
  return out.str();
}

// One program with its measurements.
class Session {
 public:
  Session(const std::string& name, const std::string& text, const Options& options,
          Database& database, std::ostream& out)
      : name_(name), options_(options), database_(database), out_(out) {
    program_ = database.program(name, text);
    machine_ = database.machine(planning::processor_name());
    graph_ = graph::parse_graph(text);
    graph::validate(graph_, "parse_graph");
    outputs_ = graph::apply_wrappers(graph_.outputs);
    tuning::bind_sample_inputs(outputs_);
  }

  void run() {
    const std::vector<Candidate> all = find_candidates(outputs_, target_, threads_of(options_));
    out_ << name_ << ": " << all.size() << " schedules\n";
    const auto begin = Clock::now();
    for (size_t i = 0; i < all.size(); i++) {
      const std::chrono::duration<double> spent = Clock::now() - begin;
      const bool may_measure =
          spent.count() < options_.seconds && (options_.limit == 0 || measured_ < options_.limit);
      look_at(all[i], i == 0, may_measure);
    }
    tell();
  }

 private:
  const std::string name_;
  const Options& options_;
  Database& database_;
  std::ostream& out_;
  const Target target_ = get_jit_target_from_environment();
  int64_t program_ = 0, machine_ = 0;
  graph::Graph graph_;  // keeps the parameters that expressions read
  std::vector<FuncPtr> outputs_;
  int measured_ = 0, known_ = 0, left_ = 0;
  double best_seconds_ = 0, default_seconds_ = 0;  // 0: none yet
  std::vector<FuncPtr> best_;

  void look_at(const Candidate& candidate, bool is_default, bool may_measure) {
    const int64_t id = database_.candidate(program_, candidate.log,
                                           graph::to_text(graph::graph_of(candidate.outputs)));
    auto found = database_.measurement(id, machine_, threads_of(options_));
    if (found) {
      known_++;
    } else if (may_measure) {
      if (measured_ == 0) wake(candidate);
      found = measure(candidate, target_, options_, best_seconds_);
      database_.keep(id, machine_, threads_of(options_), *found);
      measured_++;
      out_ << "  predicted " << in_milliseconds(found->predicted_seconds) << ", measured "
           << (found->error.empty() ? in_milliseconds(found->seconds) : found->error) << std::endl;
    } else {
      left_++;
    }
    if (!found || !found->error.empty()) return;
    if (is_default) default_seconds_ = found->seconds;
    if (best_seconds_ != 0 && found->seconds >= best_seconds_) return;
    best_seconds_ = found->seconds;
    best_ = candidate.outputs;
  }

  // Warms up: the first runs of a process are slower than all others, for longer than one schedule runs.
  void wake(const Candidate& candidate) const {
    Options longer = options_;
    longer.run_seconds *= warm_up;
    measure(candidate, target_, longer, 0);
  }

  void tell() {
    out_ << "  measured now: " << measured_ << ", before: " << known_ << ", left: " << left_
         << "\n";
    if (best_.empty()) return;
    out_ << "  best: " << in_milliseconds(best_seconds_);
    if (default_seconds_ > 0) out_ << ", the default: " << in_milliseconds(default_seconds_);
    out_ << "\n";
    if (options_.output.empty()) return;
    const ScheduleLog log = graph::schedule_log(best_);
    write_file(options_.output + "/" + name_ + ".schedule", log.to_text());
    write_file(options_.output + "/" + name_ + ".cpp", log.to_cpp());
  }
};

}  // namespace

int threads_of(const Options& options) {
  if (options.threads > 0) return options.threads;
  return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

void tune_program(const std::string& name, const std::string& text, const Options& options,
                  Database& database, std::ostream& out) {
  run_on_large_stack([&] { Session(name, text, options, database, out).run(); });
}

}  // namespace retrograde::tune
