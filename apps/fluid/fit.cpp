// fit.cpp -- see fit.h.
#include "fit.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>

#include "common/stop.h"
#include "common/timing.h"
#include "diagnostics/error.h"

namespace fluid {

using retrograde::text;

namespace {

constexpr const char* program = "fluid";

// A description of what must be the same to resume a run.
std::string problem_of(const Scene& s, const Options& o) {
  return text(o.common.input.filename().string(), " on ", s.shape.width, "x", s.shape.height,
              " cells, ", s.frames, " frames, ", s.shape.force_width, "x", s.shape.force_height,
              " nodes, optimizing ",
              retrograde::listed(o.common.optimize, [](const std::string& g) { return g; }),
              " from ", s.physics.time_step, ", ", s.physics.viscosity, ", ", s.physics.diffusion,
              ", reach ", s.reach, ", effort ", s.effort, ", swirl ", s.swirl);
}

// In addition to Adam's moments, which Adam saves under its own name.
std::string run_name(apps::Method method) { return "run." + apps::name_of(method); }

void put_run(apps::State& state, const MethodRun& run) {
  const std::string name = run_name(run.method);
  state.arrays[name + ".x"] = run.x;
  state.arrays[name + ".best"] = run.best;
  std::vector<double> series;
  for (const apps::LossSample& s : run.series) {
    series.insert(series.end(), {static_cast<double>(s.step), s.seconds, s.loss});
  }
  state.arrays[name + ".series"] = series;
  state.arrays[name + ".counts"] = {run.best_loss, static_cast<double>(run.refused)};
}

std::optional<MethodRun> get_run(const apps::State& state, apps::Method method, size_t size) {
  const std::string name = run_name(method);
  const auto found = state.arrays.find(name + ".series");
  if (found == state.arrays.end()) return {};
  MethodRun run{method, state.array(name + ".x", size), state.array(name + ".best", size)};
  for (size_t n = 0; n + 2 < found->second.size(); n += 3) {
    const double* s = found->second.data() + n;
    run.series.push_back({static_cast<long>(s[0]), s[1], s[2]});
  }
  const std::vector<double>& counts = state.array(name + ".counts", 2);
  run.best_loss = counts[0];
  run.refused = static_cast<long>(counts[1]);
  return run;
}

class Optimization {
 public:
  Optimization(const Options& options, Control<float>& control, const std::vector<double>& start,
               const std::function<void(const std::string&, long, double)>& shown)
      : options_(options), control_(control), start_(start), shown_(shown) {
    if (!options.common.resume) return;
    earlier_ = apps::read_state(file(), program);
    apps::require_same_problem(file(), *earlier_, problem_of(control.scene(), options),
                               "the scene that");
  }

  Fit run() {
    for (const apps::Method method : options_.methods) {
      run_method(method);
      if (apps::stop_requested()) break;
    }
    fit_.stopped = apps::stop_requested();
    save();
    return std::move(fit_);
  }

 private:
  std::filesystem::path file() const { return options_.common.output / "state.bin"; }

  apps::Adam make_adam() const {
    apps::AdamOptions with;
    with.schedule = apps::exponential_schedule(options_.common.steps, 0.1);
    with.epsilon = 1e-12;  // gradients of single frames are small
    with.explosion = 10;
    return apps::Adam({{start_.size(), options_.rate}}, with);
  }

  void run_method(apps::Method method) {
    std::optional<MethodRun> before;
    if (earlier_) before = get_run(*earlier_, method, start_.size());
    if (method == apps::Method::Adam) {
      adam_ = make_adam();
      if (before) adam_->restore(*earlier_, "adam");
    }
    fit_.runs.push_back(before ? *before : MethodRun{method, start_, start_});
    MethodRun& now = fit_.runs.back();
    const long left = options_.common.steps - now.steps();
    if (left <= 0) {
      now.ended = "all steps are done";
      return;
    }
    minimize(now, left);
  }

  void minimize(MethodRun& now, long left) {
    const long steps_before = now.steps();
    const double seconds_before = now.seconds();
    const bool is_adam = now.method == apps::Method::Adam;
    const double scale = is_adam ? 1 : scale_of_loss();
    apps::Problem problem;
    problem.size = start_.size();
    problem.evaluate = [&](std::span<const double> x, std::span<double> gradient) {
      const double loss = evaluate(now, x, gradient);
      for (double& g : gradient) g *= scale;
      return scale * loss;
    };
    apps::MinimizeOptions with;
    with.method = now.method;
    with.steps = left;
    with.seconds = options_.common.seconds;
    if (is_adam) with.moments = &*adam_;
    // Adam continues from its current point. The others lose their history and continue from the best point.
    const std::vector<double> from = is_adam ? now.x : now.best;
    const apps::Minimum found =
        apps::minimize(problem, from, with, [&](const apps::LossSample& s, auto) {
          const double loss = s.loss / scale;
          now.series.push_back({s.step + steps_before, s.seconds + seconds_before, loss});
          shown_(apps::name_of(now.method), now.steps(), loss);
          if (timer_.is_due()) save();
          return true;
        });
    now.refused += found.refused;
    now.ended = found.ended;
  }

  // The first step of a line search has the length of the gradient. Because the loss is a mean over all cells and
  // frames, that is small; this factor makes its largest element 1.
  double scale_of_loss() {
    std::vector<double> gradient(start_.size());
    control_.loss(start_, gradient);
    double largest = 0;
    for (const double g : gradient) largest = std::max(largest, std::abs(g));
    return largest > 0 ? 1 / largest : 1;
  }

  double evaluate(MethodRun& now, std::span<const double> x, std::span<double> gradient) {
    const auto start = std::chrono::steady_clock::now();
    const double loss = control_.loss(x, gradient);
    if (!gradient.empty()) fit_.gradient_seconds.push_back(apps::seconds_since(start));
    if (now.series.empty()) now.series.push_back({0, 0, loss});
    now.x.assign(x.begin(), x.end());
    if (loss < now.best_loss) {
      now.best_loss = loss;
      now.best = now.x;
    }
    return loss;
  }

  void save() const {
    apps::State state;
    if (earlier_) state = *earlier_;
    state.program = program;
    state.words["problem"] = problem_of(control_.scene(), options_);
    for (const MethodRun& run : fit_.runs) {
      put_run(state, run);
      if (run.method == apps::Method::Adam && adam_) adam_->save(state, "adam");
      state.step = std::max<int64_t>(state.step, run.steps());
    }
    const size_t force = control_.variables().force_size();
    const std::vector<double>& best = fit_.best().best;
    state.arrays["force"].assign(best.begin(), best.begin() + static_cast<long>(force));
    apps::write_state(file(), state);
  }

  const Options& options_;
  Control<float>& control_;
  const std::vector<double>& start_;
  const std::function<void(const std::string&, long, double)>& shown_;
  std::optional<apps::State> earlier_;
  std::optional<apps::Adam> adam_;
  apps::SaveTimer timer_;
  Fit fit_;
};

}  // namespace

const MethodRun& Fit::best() const {
  return *std::min_element(runs.begin(), runs.end(), [](const MethodRun& a, const MethodRun& b) {
    return a.best_loss < b.best_loss;
  });
}

double Fit::median_gradient_seconds() const { return apps::median(gradient_seconds); }

Fit optimize(const Options& options, Control<float>& control, const std::vector<double>& start,
             const std::function<void(const std::string&, long, double)>& shown) {
  return Optimization(options, control, start, shown).run();
}

std::vector<float> read_force(const std::filesystem::path& file, size_t size) {
  const apps::State state = apps::read_state(file, program);
  const std::vector<double>& force = state.array("force", size);
  return {force.begin(), force.end()};
}

}  // namespace fluid
