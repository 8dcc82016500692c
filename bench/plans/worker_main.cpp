// worker_main.cpp -- prices and measures plans of one program. plans.py starts a worker for each program.
//
//   bench_plans PROGRAM.graph [options]
//       prints a line of JSON for each plan; a line {"starts": KEY} before it tells which plan ended a process
//   bench_plans PROGRAM.graph --pair FAST_KEY SLOW_KEY --wrong MODELS --fast SECONDS --slow SECONDS [options]
//       prints the pair as pair_file.h describes it
#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "autoschedule/machine/kept_machine.h"
#include "diagnostics/error.h"
#include "diagnostics/large_stack.h"
#include "models.h"
#include "pair_file.h"
#include "plan_sample.h"
#include "tuning/measure_schedule.h"
#include "tuning/measure_stages.h"

namespace bench::plans {
namespace {

using namespace retrograde;
using namespace std::chrono_literals;
using Json = nlohmann::json;
using Clock = std::chrono::steady_clock;

constexpr double most_slowdown = 1.08;  // of the default plan, in an undisturbed measurement
constexpr int turns = 3;
constexpr int fewest_runs = 2;  // in a turn

// The fastest runs of a plan, and of the default plan at the same time.
struct Measured {
  double seconds = std::numeric_limits<double>::infinity();
  double standard_seconds = std::numeric_limits<double>::infinity();
  int runs = 0;
};

struct Options {
  std::string graph;
  SampleOptions sample;
  double seconds = 0.2;              // that a plan runs
  double stage_seconds = 0;          // that the default plan runs under the profiler; 0: it doesn't
  int repeats = 2;                   // of measurements that other load disturbs
  double hopeless = 4;               // times the default's time: one run is enough
  std::vector<std::string> skipped;  // keys
  std::vector<std::string> pair;     // keys of the fast and the slow plan
  PlanPair figures;                  // of the pair
  std::vector<std::string> wrong;
};

std::string contents_of(const std::string& path) {
  std::ifstream in(path);
  if (!in) user_error("read " + retrograde::quoted(path), "the file must exist and be readable");
  return {std::istreambuf_iterator<char>(in), {}};
}

// Empty if none were kept.
std::string values_beside(const std::string& graph) {
  const std::string path = graph + ".values";
  return std::filesystem::exists(path) ? contents_of(path) : "";
}

void print(const Json& line) { std::cout << line.dump() << std::endl; }

// By the name of a Func that shares loops with another: the name of that. The profiler counts both as one.
std::map<std::string, std::string> shared_loops(const planning::Plan& plan) {
  const auto name_of = [&](planning::FuncId id) {
    return plan.program->funcs[static_cast<size_t>(id)]->name;
  };
  std::map<std::string, std::string> result;
  for (planning::FuncId id = 0; id < static_cast<planning::FuncId>(plan.funcs.size()); ++id) {
    planning::FuncId host = id;
    for (bool moves = true; moves;) {
      moves = false;
      for (const planning::Nest& nest : plan.of(host).nests) {
        if (!nest.shared_with || nest.shared_with->stage.func == host) continue;
        host = nest.shared_with->stage.func;
        moves = true;
        break;
      }
    }
    if (host != id) result[name_of(id)] = name_of(host);
  }
  return result;
}

class Worker {
 public:
  explicit Worker(const Options& options)
      : options_(options),
        models_(all_models(options.sample.machine, options.sample.target)),
        program_(load_program(contents_of(options.graph), values_beside(options.graph))),
        plans_(sample_plans(program_.outputs, options.sample)) {}

  void measure_all() {
    print({{"machine", options_.sample.machine.name},
           {"threads", options_.sample.machine.threads},
           {"funcs", plans_[0].plan.funcs.size()},
           {"sampled", plans_.size()}});
    print({{"starts", plans_[0].key}});
    standard_ = compiled(plans_[0]);
    measure(*standard_);  // the first runs of a process are slower than all others
    const std::set<std::string> skipped(options_.skipped.begin(), options_.skipped.end());
    std::vector<const SampledPlan*> left;
    for (const SampledPlan& plan : plans_) {
      if (!skipped.contains(plan.key)) left.push_back(&plan);
    }
    for (int i = 0; i <= options_.repeats && !left.empty(); ++i) left = measured(left);
    print({{"again", row_of(measure(*compiled(plans_[0])))}});
  }

  void print_pair() {
    PlanPair pair = options_.figures;
    pair.program = std::filesystem::path(options_.graph).stem();
    pair.wrong.insert(options_.wrong.begin(), options_.wrong.end());
    pair.fast = find(options_.pair[0]).plan;
    pair.slow = find(options_.pair[1]).plan;
    std::cout << to_text(pair);
  }

 private:
  const Options& options_;
  const std::map<std::string, Model> models_;
  const LoadedProgram program_;
  const std::vector<SampledPlan> plans_;
  std::unique_ptr<tuning::CompiledSchedule> standard_;
  double least_standard_seconds_ = std::numeric_limits<double>::infinity();

  const SampledPlan& find(const std::string& key) const {
    const auto found = std::ranges::find(plans_, key, &SampledPlan::key);
    if (found == plans_.end())
      user_error("print a pair", "the sample has both plans", "it has none with the key " + key,
                 "Use the options with which it was measured");
    return *found;
  }

  std::unique_ptr<tuning::CompiledSchedule> compiled(const SampledPlan& plan) const {
    return std::make_unique<tuning::CompiledSchedule>(planning::emit_plan(plan.plan),
                                                      options_.sample.target, 0);
  }

  // Runs the default plan and another in turn, so that other load on the machine slows down both. A turn has several
  // runs: the first of them finds the caches as the other plan left them.
  Measured measure(const tuning::CompiledSchedule& plan) const {
    Measured result;
    const auto turn = [&](const tuning::CompiledSchedule& runs, double& least) {
      const auto begin = Clock::now();
      int count = 0;
      do {
        least = std::min(least, runs.run());
        ++count;
      } while (count < fewest_runs || Clock::now() - begin < options_.seconds / (2 * turns) * 1s);
      return count;
    };
    for (int i = 0; i < turns; ++i) {
      turn(*standard_, result.standard_seconds);
      if (i == 0 && is_hopeless(plan, result)) return result;
      result.runs += turn(plan, result.seconds);
    }
    return result;
  }

  // Measures two runs if these show that the plan is far from the fastest: the first is slower than others.
  bool is_hopeless(const tuning::CompiledSchedule& plan, Measured& result) const {
    const double most = options_.hopeless * result.standard_seconds;
    if (plan.run() < most || (result.seconds = plan.run()) < most) return false;
    result.runs = 1;
    return true;
  }

  // Prints the plans' rows, and returns those during whose measurement other load slowed down the default plan.
  std::vector<const SampledPlan*> measured(const std::vector<const SampledPlan*>& plans) {
    std::vector<std::pair<const SampledPlan*, double>> found;
    for (const SampledPlan* plan : plans) {
      print({{"starts", plan->key}});
      const Json row = row_of(*plan);
      print(row);
      if (!row.contains("seconds")) continue;
      const double seconds = row["default_seconds"];
      least_standard_seconds_ = std::min(least_standard_seconds_, seconds);
      found.emplace_back(plan, seconds);
    }
    std::vector<const SampledPlan*> disturbed;
    for (const auto& [plan, seconds] : found) {
      if (seconds > most_slowdown * least_standard_seconds_) disturbed.push_back(plan);
    }
    return disturbed;
  }

  static Json row_of(const Measured& measured) {
    return {{"seconds", measured.seconds},
            {"default_seconds", measured.standard_seconds},
            {"runs", measured.runs}};
  }

  Json row_of(const SampledPlan& plan) {
    Json row = {{"key", plan.key}, {"source", plan.source}};
    try {
      for (const auto& [name, model] : models_) {
        const Price price = model(plan.plan);
        row["prices"][name] = {{"seconds", price.seconds},
                               {"stages", price.stages},
                               {"peak_bytes", price.peak_bytes},
                               {"price_seconds", price.price_seconds}};
      }
      row.update(row_of(measure(*compiled(plan))));
      if (&plan == &plans_[0] && options_.stage_seconds > 0) add_stages(plan, row);
    } catch (const Error& error) {
      row["error"] = error.what();
    }
    return row;
  }

  void add_stages(const SampledPlan& plan, Json& row) const {
    const std::vector<FuncPtr> scheduled = planning::emit_plan(plan.plan);
    std::vector<Buffer<>> buffers = tuning::sample_outputs(scheduled);
    std::vector<halide_buffer_t*> raw;
    for (Buffer<>& buffer : buffers) raw.push_back(buffer.raw_buffer());
    ExplainOptions measuring;
    measuring.seconds = options_.stage_seconds;
    const tuning::MeasuredStages stages = tuning::measure_stages(
        {"plan", scheduled}, scheduled, raw, options_.sample.target, measuring, {});
    row["stages"] = stages.seconds;
    row["shared"] = shared_loops(plan.plan);
    row["sampled_seconds"] = stages.sampled_seconds;
    row["stages_seconds"] = stages.total_seconds;
    row["peak_bytes"] = stages.peak_bytes;
  }
};

int run(int argc, char** argv) {
  Options options;
  options.sample.target = get_jit_target_from_environment();
  options.sample.machine = planning::machine_for(options.sample.target);
  CLI::App app{"prices and measures plans of one program"};
  app.add_option("graph", options.graph)->required();
  app.add_option("--decisions", options.sample.decisions,
                 "default plans without one or two decisions, at the most");
  app.add_option("--walks", options.sample.walks, "plans of random moves, at the most");
  app.add_option("--widths", options.sample.widths, "of searches over moves")->delimiter(',');
  app.add_flag("--ablation", options.sample.ablation, "searches without one of the moves");
  app.add_option("--seed", options.sample.seed, "of the moves");
  app.add_option("--seconds", options.seconds, "that each plan runs");
  app.add_option("--stage-seconds", options.stage_seconds,
                 "that the default runs under the profiler");
  app.add_option("--repeats", options.repeats, "of disturbed measurements");
  app.add_option("--hopeless", options.hopeless, "times the default's time");
  app.add_option("--skip", options.skipped, "keys of plans")->delimiter(',');
  app.add_option("--pair", options.pair, "keys")->expected(2);
  app.add_option("--fast", options.figures.fast_seconds);
  app.add_option("--slow", options.figures.slow_seconds);
  app.add_option("--wrong", options.wrong)->delimiter(',');
  CLI11_PARSE(app, argc, argv);
  run_on_large_stack([&] {
    Worker worker(options);
    options.pair.empty() ? worker.measure_all() : worker.print_pair();
  });
  return 0;
}

}  // namespace
}  // namespace bench::plans

int main(int argc, char** argv) {
  try {
    return bench::plans::run(argc, argv);
  } catch (const std::exception& error) {
    std::cerr << "bench_plans: " << error.what() << "\n";
    return 1;
  }
}
