// gradients.cpp -- run time of gradients compared with that of their programs.
//
//   bench_gradients [--program NAME] [--output FILE] [--side N] [--rounds N]
//
// The programs are the large ones of the gradient suite (test/gradient/programs_large.h). Both sides have a fair
// schedule. Gradients have their default one. Programs have one of the same kind (reductions and updated Funcs are
// stored; rows run in parallel, in vectors along x), and their final sum is split into parallel rows and lanes. Rounds
// alternate; the least time of each side counts, because other load on the machine only adds time. The ratio is that of
// a gradient by all inputs, including the values of the program that it needs.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "frontend/run/pipeline.h"
#include "gradient/programs_large.h"

namespace {

using namespace retrograde;
using namespace retrograde::gradient;

constexpr int lanes = 16, parts = 64;

struct Options {
  std::string program, output;  // empty: all; none
  int side = 1024, rounds = 15;
};

Options parse(int argc, char** argv) {
  Options options;
  for (int i = 1; i + 1 < argc; i += 2) {
    const std::string name = argv[i];
    if (name == "--program") {
      options.program = argv[i + 1];
    } else if (name == "--output") {
      options.output = argv[i + 1];
    } else if (name == "--side") {
      options.side = std::atoi(argv[i + 1]);
    } else if (name == "--rounds") {
      options.rounds = std::atoi(argv[i + 1]);
    } else {
      std::fprintf(stderr, "bench_gradients: unknown argument %s\n", argv[i]);
      std::exit(2);
    }
  }
  return options;
}

// Rows in parallel and vectors along the first dimension, both over pure dimensions.
template <typename StageOrFunc>
void schedule_stage(StageOrFunc stage, const std::vector<Var>& pure) {
  if (pure.size() > 1) stage.parallel(pure.back());
  if (!pure.empty()) stage.vectorize(pure[0], lanes, TailStrategy::GuardWithIf);
  if (pure.size() == 1) stage.parallel(pure[0]);  // over the vectors
}

void schedule_sum(const Func& loss) {
  Func sum = loss;
  const std::vector<RVar> r = sum.rvars(0);
  RVar outer("outer"), inner("inner"), chunk("chunk");
  Var u("u"), v("v");
  sum.update().split(r[0], outer, inner, lanes);
  RVar rows = r.size() > 1 ? r[1] : chunk;
  if (r.size() == 1) {
    RVar rest("rest");
    sum.update().split(outer, chunk, rest, parts);
  }
  Func partial = sum.update().rfactor({{rows, u}, {inner, v}});
  partial.compute_root();
  partial.update().vectorize(v, lanes).parallel(u);
}

// Schedules everything except the final sum.
void schedule_primal(const Func& loss) {
  for (const graph::FuncPtr& contents : graph::topological_order({loss.function()})) {
    if (contents == loss.function() || contents->is_pure()) continue;
    Func f(contents);
    f.compute_root();
    schedule_stage(f, f.args());
    for (int s = 0; s < f.num_update_definitions(); ++s) {
      std::vector<Var> pure;
      for (int d = 0; d < f.dimensions(); ++d) {
        const auto* v = contents->updates[static_cast<size_t>(s)]
                            .args[static_cast<size_t>(d)]
                            .as<ir::Variable>();
        if (v && v->name == f.args()[static_cast<size_t>(d)].name())
          pure.push_back(f.args()[static_cast<size_t>(d)]);
      }
      const bool along_rows = !pure.empty() && pure[0].name() == f.args()[0].name();
      if (along_rows) schedule_stage(f.update(s), pure);
      if (!along_rows && !pure.empty()) f.update(s).parallel(pure.back());
    }
  }
  schedule_sum(loss);
}

// Compiled on the first call.
struct Side {
  Pipeline pipeline;
  std::vector<Buffer<>> results;
  std::vector<double> milliseconds;

  void run() {
    const auto start = std::chrono::steady_clock::now();
    pipeline.realize(Realization(results));
    milliseconds.push_back(
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
            .count());
  }
  double least() const { return *std::min_element(milliseconds.begin(), milliseconds.end()); }
  double median() {
    std::sort(milliseconds.begin(), milliseconds.end());
    return milliseconds[milliseconds.size() / 2];
  }
};

Side primal_side(const LargeProgram& program, int side) {
  const Program p = program.build(side);
  schedule_primal(p.loss);
  return {Pipeline(p.loss), {Buffer<float>::make_scalar()}, {}};
}

Side gradient_side(const LargeProgram& program, int side) {
  const Program p = program.build(side);
  AdjointOptions options;
  if (p.store_overwritten) options.overwritten = Overwritten::Store;
  const Derivative d = propagate_adjoints(p.loss, options);
  Side result;
  std::vector<Func> gradients;
  for (const Buffer<float>& input : p.inputs) {
    gradients.push_back(d(input));
    result.results.push_back(
        Buffer<float>(oracle::region_of(*Buffer<>(input).raw_buffer()).extents));
  }
  result.pipeline = Pipeline(gradients);
  return result;
}

nlohmann::json measure(const LargeProgram& program, const Options& options) {
  Side primal = primal_side(program, options.side), gradient = gradient_side(program, options.side);
  primal.run(), gradient.run();  // compiles
  primal.milliseconds.clear(), gradient.milliseconds.clear();
  for (int i = 0; i < options.rounds; ++i) primal.run(), gradient.run();
  const double p = primal.least(), g = gradient.least();
  std::printf("%-34s %10.3f %10.3f %8.2f\n", program.name, p, g, g / p);
  std::fflush(stdout);
  return {{"program", program.name},
          {"primal_ms", p},
          {"gradient_ms", g},
          {"ratio", g / p},
          {"primal_median_ms", primal.median()},
          {"gradient_median_ms", gradient.median()}};
}

}  // namespace

int main(int argc, char** argv) {
  const Options options = parse(argc, argv);
  std::printf("%-34s %10s %10s %8s\n", "program", "primal ms", "gradient", "ratio");
  nlohmann::json report{{"side", options.side}, {"rounds", options.rounds}};
  for (const LargeProgram& program : large_programs()) {
    if (options.program.empty() || options.program == program.name)
      report["programs"].push_back(measure(program, options));
  }
  if (!options.output.empty()) std::ofstream(options.output) << report.dump(2) << "\n";
}
