// shorten.cpp -- see shorten.h.
#include "shorten.h"

#include <algorithm>
#include <chrono>
#include <random>

#include "common/stop.h"

namespace lens {

namespace {

// A penalty is never met exactly, so the loss demands a length shorter by this fraction.
constexpr double margin = 0.002;
constexpr double adam_rate = 0.3, adam_last = 0.02;

apps::Problem problem_of(Evaluator& evaluator, const Scene& scene) {
  apps::Problem problem{.size = scene.variables.size()};
  problem.evaluate = [&](std::span<const double> x, std::span<double> gradient) {
    return evaluator.loss(x, gradient);
  };
  problem.hessian_product = [&](std::span<const double> x, std::span<const double> v,
                                std::span<double> product) {
    evaluator.hessian_product(x, v, product);
  };
  return problem;
}

// Appends a stage's series to those before it; its sample 0 is the end of the previous stage.
void append(Run& run, const apps::Minimum& stage) {
  const double before = run.series.empty() ? 0 : run.series.back().seconds;
  for (const apps::LossSample& sample : stage.series)
    run.series.push_back({run.steps + sample.step, before + sample.seconds, sample.loss});
  run.x = stage.x;
  run.loss = stage.loss;
  run.steps += stage.steps;
  run.evaluations += stage.evaluations;
  run.products += stage.products;
  run.refused += stage.refused;
  run.stopped |= stage.stopped;
}

// Random changes of the initial lens, of about a fifth of the strongest curvatures and a millimetre at f = 100.
std::vector<double> moved_start(const Scene& scene, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  std::vector<double> x = start_of(scene);
  for (size_t n = 0; n < x.size(); ++n) {
    x[n] += normal(random);
    if (scene.variables[n].group == "spacings") x[n] = std::max(x[n], 0.2);
  }
  return x;
}

}  // namespace

Run shorten(Evaluator& evaluator, const Scene& scene, const ShortenOptions& options,
            const ShortenCallback& callback) {
  const apps::Problem problem = problem_of(evaluator, scene);
  Run run;
  run.method = apps::name_of(options.method);
  run.x = options.x.empty() ? start_of(scene) : options.x;
  for (int stage = options.first_stage; stage < options.stages && !run.stopped; ++stage) {
    const int left = options.stages - stage;
    const double part = static_cast<double>(stage + 1) / options.stages;
    evaluator.set_goal(scene.lens.length() * (1 - options.shorter * part) * (1 - margin));
    apps::MinimizeOptions how{.method = options.method};
    how.steps = std::max((options.steps - run.steps) / left, 1L);
    const double spent = run.series.empty() ? 0 : run.series.back().seconds;
    // Even if the time limit is used up, each stage gets one step.
    if (options.seconds > 0) how.seconds = std::max((options.seconds - spent) / left, 1e-6);
    how.rate = adam_rate;
    how.adam.schedule = apps::exponential_schedule(how.steps, adam_last);
    how.loss_tolerance = 1e-9;
    how.memory = 40;
    append(run, apps::minimize(problem, run.x, how,
                               [&](const apps::LossSample& sample, std::span<const double> best) {
                                 if (callback)
                                   callback(stage, run.steps + sample.step, sample.loss, best);
                                 return true;
                               }));
  }
  return run;
}

Run shorten_from_many(Evaluator& evaluator, const Scene& scene, const ShortenOptions& options,
                      int restarts, uint64_t seed, Run best,
                      const std::function<void(int restart, double best_loss)>& callback) {
  std::mt19937_64 random(seed);
  ShortenOptions from_elsewhere = options;
  // A random start has no length from which to shorten gradually, so there is only one stage.
  from_elsewhere.stages = 1;
  from_elsewhere.first_stage = 0;
  const auto begin = std::chrono::steady_clock::now();
  const auto time_is_over = [&] {
    const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - begin;
    return options.seconds > 0 && spent.count() >= options.seconds;
  };
  for (int n = 0; n < restarts && !apps::stop_requested() && !time_is_over(); ++n) {
    from_elsewhere.x = moved_start(scene, random);
    Run run = shorten(evaluator, scene, from_elsewhere);
    if (run.loss < best.loss) {
      best.x = run.x;
      best.loss = run.loss;
      best.restart = n + 1;
    }
    if (callback) callback(n + 1, best.loss);
  }
  best.stopped |= apps::stop_requested();
  return best;
}

}  // namespace lens
