#include "fit_database.h"

#include <algorithm>
#include <iomanip>
#include <numeric>
#include <ostream>

#include "diagnostics/error.h"
#include "diagnostics/large_stack.h"
#include "graph/graph.h"
#include "lower/lower.h"
#include "tuning/fit_machine.h"
#include "tuning/predict.h"

namespace retrograde::tune {

namespace {

using planning::Machine;
using tuning::FitSample;

constexpr size_t most_samples = 240;  // of all programs together, the same number for each

FitSample sample_of(const Measured& measured, const Target& target, int threads) {
  const graph::Graph graph = graph::parse_graph(measured.graph);
  lower::LowerOptions lowering;
  lowering.target = target;
  const ir::LoweredFunction function =
      lower::lower("fitted", graph.outputs, lower::infer_arguments(graph.outputs), lowering);
  const tuning::ProgramSizes sizes =
      tuning::program_sizes(function, tuning::output_shapes(graph.outputs));
  return {tuning::seconds_predictor(function, sizes, planning::machine_for(target), threads),
          measured.measurement.seconds};
}

struct Program {
  std::string name;
  std::vector<FitSample> samples;
};

// Takes the same number of samples from each program, spread evenly from the fastest to the slowest.
std::vector<Program> samples_of(const std::vector<Measured>& all, const Target& target,
                                int threads) {
  std::vector<std::vector<const Measured*>> by_program;
  for (const Measured& measured : all) {
    if (by_program.empty() || by_program.back()[0]->program != measured.program)
      by_program.emplace_back();
    by_program.back().push_back(&measured);
  }
  const size_t share = std::max<size_t>(2, most_samples / std::max<size_t>(1, by_program.size()));
  std::vector<Program> result;
  for (const auto& of : by_program) {
    Program program{of[0]->program_name, {}};
    const size_t count = std::min(share, of.size());
    for (size_t i = 0; i < count; i++)
      program.samples.push_back(sample_of(*of[i * of.size() / count], target, threads));
    result.push_back(std::move(program));
  }
  return result;
}

std::vector<FitSample> those(const std::vector<Program>& programs,
                             const std::function<bool(size_t)>& wanted) {
  std::vector<FitSample> result;
  for (size_t i = 0; i < programs.size(); i++) {
    if (wanted(i))
      result.insert(result.end(), programs[i].samples.begin(), programs[i].samples.end());
  }
  return result;
}

std::vector<double> ranks(const std::vector<double>& values) {
  std::vector<size_t> order(values.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](size_t a, size_t b) { return values[a] < values[b]; });
  std::vector<double> result(values.size());
  for (size_t i = 0; i < order.size(); i++) result[order[i]] = static_cast<double>(i);
  return result;
}

// Spearman's rank correlation of predicted and measured times.
double rank_correlation(const Machine& machine, const std::vector<FitSample>& samples) {
  if (samples.size() < 2) return 1;
  std::vector<double> predicted, measured;
  for (const FitSample& sample : samples) {
    predicted.push_back(sample.predict(machine));
    measured.push_back(sample.measured_seconds);
  }
  const std::vector<double> a = ranks(predicted), b = ranks(measured);
  double squares = 0;
  for (size_t i = 0; i < a.size(); i++) squares += (a[i] - b[i]) * (a[i] - b[i]);
  const auto n = static_cast<double>(a.size());
  return 1 - 6 * squares / (n * (n * n - 1));
}

void tell(const char* what, const Machine& before, const Machine& after,
          const std::vector<FitSample>& samples, std::ostream& out) {
  out << what << ": " << samples.size() << " schedules; wrong by a factor of "
      << tuning::fit_error(before, samples) << " before, " << tuning::fit_error(after, samples)
      << " after; rank correlation " << rank_correlation(before, samples) << " before, "
      << rank_correlation(after, samples) << " after\n";
}

void tell_held_out(const Machine& start, const std::vector<Program>& programs, std::ostream& out) {
  if (programs.size() < 2) return;
  for (const size_t half : {size_t{0}, size_t{1}}) {
    const auto seen = those(programs, [&](size_t i) { return i % 2 == half; });
    const auto others = those(programs, [&](size_t i) { return i % 2 != half; });
    tell("  held out", start, tuning::fit_machine(start, seen).machine, others, out);
  }
}

}  // namespace

Machine fit_database(Database& database, int threads, std::ostream& out) {
  const std::vector<Measured> all =
      database.measured(database.machine(planning::processor_name()), threads);
  if (all.empty()) {
    user_error("fit the model of " + retrograde::quoted(planning::processor_name()),
               "the database has measurements of this machine with that number of threads",
               text("there are none with ", threads), "Measure some programs first: tune FILE");
  }
  const Target target = get_jit_target_from_environment();
  const Machine start = planning::machine_for(target);
  Machine result;
  run_on_large_stack([&] {
    const std::vector<Program> programs = samples_of(all, target, threads);
    const auto samples = those(programs, [](size_t) { return true; });
    const tuning::MachineFit fit = tuning::fit_machine(start, samples);
    out << std::setprecision(3);
    tell("all", start, fit.machine, samples, out);
    tell_held_out(start, programs, out);
    for (const tuning::FittedTerm& term : fit.terms)
      out << "  " << std::left << std::setw(12) << term.name << " times " << term.factor << "\n";
    result = fit.machine;
  });
  return result;
}

}  // namespace retrograde::tune
