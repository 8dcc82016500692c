#include "checks.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <random>

#include "common/checks.h"
#include "common/report.h"
#include "demosaicker.h"
#include "photographs.h"
#include "training.h"
#include "weights.h"

namespace demosaic {

namespace {

constexpr BatchShape small_batch{.cells = 6, .pieces = 1};
constexpr unsigned fixed_seed = 11;

// Weights away from the initial ones, at which candidates are equal and parts of the gradient vanish by symmetry.
Weights shaken(const Shape& shape) {
  Weights weights(shape);
  std::mt19937 random(fixed_seed);
  for (float& value : weights.values) {
    value += (static_cast<float>(random() % 1024) / 1024 - 0.5f) * 0.1f;
  }
  return weights;
}

Photograph photograph_of(const Options& options) {
  if (!options.common.input.empty()) return read_photograph(options.common.input);
  return read_dataset(options.dataset).train.front();
}

// The objective in one precision, with its schedule's estimates and the gradient by all arrays.
template <typename T>
class Evaluator {
 public:
  Evaluator(const Shape& shape, int threads)
      : objective_(shape, small_batch, lang::type_of<T>()),
        adjoints_(lang::propagate_adjoints(objective_.loss)) {
    std::vector<lang::Func> outputs{objective_.loss, objective_.model.image};
    for (Array array : all_arrays)
      outputs.push_back(adjoints_(learned_func(objective_.model, array)));
    pipeline_ = lang::Pipeline(outputs);
    pipeline_.auto_schedule(lang::get_jit_target_from_environment(), machine_of(threads));
  }

  void bind(const Batch& batch) { objective_.bind(batch); }

  double evaluate(const Shape& shape, std::span<const double> weights) {
    std::vector<T> values(weights.begin(), weights.end());
    gradient_.assign(values.size(), T(0));
    lang::Buffer<T> loss = lang::Buffer<T>::make_scalar();
    constexpr int side = 2 * small_batch.cells;
    lang::Buffer<T> image(std::vector<int>{side, side, 3, 1});
    std::vector<lang::Buffer<>> outputs{loss, image};
    size_t from = 0;
    for (Array array : all_arrays) {
      const auto sizes = sizes_of(shape, array);
      objective_.model.parameters.of(array).set(lang::Buffer<T>(values.data() + from, sizes));
      outputs.push_back(lang::Buffer<T>(gradient_.data() + from, sizes));
      from += elements_of(shape, array);
    }
    pipeline_.realize(lang::Realization(outputs));
    image_.clear();
    image.for_each_value([&](T value) { image_.push_back(value); });
    return loss();
  }

  std::vector<double> image() const { return {image_.begin(), image_.end()}; }
  std::vector<double> gradient() const { return {gradient_.begin(), gradient_.end()}; }

 private:
  Objective objective_;
  lang::Derivative adjoints_;
  lang::Pipeline pipeline_;
  std::vector<T> image_, gradient_;
};

// Test content of a sensor as a function of position, with its name.
struct Frame {
  const char* name;
  std::function<float(int x, int y)> sample;
};

std::vector<Frame> frames() {
  const auto noise = [](int x, int y) {
    std::mt19937 random(static_cast<unsigned>(1000 * (y + 100) + x + 100));
    return static_cast<float>(random() % 4096) / 4096;
  };
  const auto wave = [](int x, int y) {
    return 0.5f + 0.5f * static_cast<float>(std::sin(0.9 * x + 0.3 * y));
  };
  return {
      {"black", [](int, int) { return 0.0f; }},
      {"saturated", [](int, int) { return 1.0f; }},
      {"black beside saturated", [](int x, int) { return x < 6 ? 0.0f : 1.0f; }},
      {"one bright sample on black", [](int x, int y) { return x == 6 && y == 6 ? 1.0f : 0.0f; }},
      {"every other row saturated", [](int, int y) { return y % 2 == 0 ? 1.0f : 0.0f; }},
      {"red saturated, else black",
       [](int x, int y) { return x % 2 == 0 && y % 2 == 0 ? 1.0f : 0.0f; }},
      {"clipped waves",
       [wave](int x, int y) { return std::clamp(3 * wave(x, y) - 1, 0.0f, 1.0f); }},
      {"noise of 1e-6 in the dark", [noise](int x, int y) { return 1e-6f * noise(x, y); }},
      {"denormal noise", [noise](int x, int y) { return 1e-40f * noise(x, y); }},
      {"noise", noise}};
}

// The frame, with other colours as truth so that there is a gradient.
Batch batch_of(const Shape& shape, const Frame& frame) {
  Batch batch(shape, small_batch);
  batch.mosaic.for_each_element(
      [&](int x, int y, int n) { batch.mosaic(x, y, n) = frame.sample(x, y); });
  std::mt19937 random(fixed_seed);
  batch.truth.for_each_value(
      [&](float& value) { value = static_cast<float>(random() % 1024) / 1024; });
  return batch;
}

apps::StabilityRow stability_of(const Shape& shape, const Frame& frame, Evaluator<float>& own,
                                Evaluator<double>& exact) {
  constexpr long steps = 60;
  constexpr double large_rate = 0.3;  // about a hundred times the rate that learning uses
  const Batch batch = batch_of(shape, frame);
  const Weights weights = shaken(shape);
  const std::vector<double> at(weights.values.begin(), weights.values.end());
  own.bind(batch);
  exact.bind(batch);
  own.evaluate(shape, at);
  exact.evaluate(shape, at);
  apps::StabilityRow row{frame.name,
                         apps::relative_error(own.image(), exact.image()),
                         apps::relative_error(own.gradient(), exact.gradient()),
                         {},
                         {},
                         steps};
  const apps::Problem problem{.size = at.size(),
                              .evaluate = [&](std::span<const double> x, std::span<double> g) {
                                const double loss = own.evaluate(shape, x);
                                const auto gradient = own.gradient();
                                if (!g.empty())
                                  std::copy(gradient.begin(), gradient.end(), g.begin());
                                return loss;
                              }};
  apps::measure_divergence(row, problem, at, apps::large_steps(steps, large_rate));
  return row;
}

// The loss is smooth everywhere.
double difference_along(const Shape& shape, Evaluator<double>& exact, const std::vector<double>& at,
                        const std::vector<double>& direction) {
  return apps::difference_along([&](const auto& x) { return exact.evaluate(shape, x); }, at,
                                direction, 1e-4);
}

// For each array: the worst error of the adjoint in double against differences along random directions, and the adjoint
// in float32 against double. Uses the same two pipelines as the stability check.
std::vector<apps::GradientRow> gradient_rows(const Shape& shape, Evaluator<float>& own,
                                             Evaluator<double>& exact) {
  constexpr int directions = 3;
  const Weights weights = shaken(shape);
  const std::vector<double> at(weights.values.begin(), weights.values.end());
  own.evaluate(shape, at);
  exact.evaluate(shape, at);
  const auto adjoint = exact.gradient(), in_float = own.gradient();
  std::mt19937 random(fixed_seed);
  std::vector<apps::GradientRow> rows;
  size_t from = 0;
  for (Array array : all_arrays) {
    const size_t size = elements_of(shape, array);
    double worst = 0;
    for (int k = 0; k < directions; ++k) {
      std::vector<double> direction(at.size(), 0.0);
      double along = 0;
      for (size_t n = from; n < from + size; ++n) {
        direction[n] = static_cast<double>(random() % 2048) / 1024 - 1;
        along += direction[n] * adjoint[n];
      }
      const double difference = difference_along(shape, exact, at, direction);
      const double error = std::abs(along - difference) / std::max(std::abs(along), 1e-300);
      if (!(error <= worst)) worst = error;
    }
    const auto part = [&](const std::vector<double>& all) {
      return std::span(all).subspan(from, size);
    };
    rows.push_back({name_of(array), worst, apps::relative_error(part(in_float), part(adjoint)),
                    "differences"});
    from += size;
  }
  return rows;
}

void finish(const Options& options, const apps::Table& table) {
  apps::report_tables("demosaic", options.common, {table});
  std::printf("report in %s\n", (options.common.output / "report.json").c_str());
}

void check_gradients(const Options& options) {
  const std::vector<Photograph> photographs{photograph_of(options)};
  const Batch batch = Sampler(photographs, options.common.seed).draw(options.shape, small_batch);
  Evaluator<float> own(options.shape, options.common.threads);
  Evaluator<double> exact(options.shape, options.common.threads);
  own.bind(batch);
  exact.bind(batch);
  const auto rows = gradient_rows(options.shape, own, exact);
  finish(options, apps::gradient_table(rows));
  apps::require_gradients(rows);
}

void check_stability(const Options& options) {
  std::vector<apps::StabilityRow> rows;
  Evaluator<float> own(options.shape, options.common.threads);
  Evaluator<double> exact(options.shape, options.common.threads);
  for (const Frame& frame : frames()) {
    rows.push_back(stability_of(options.shape, frame, own, exact));
  }
  finish(options, apps::stability_table(rows));
}

}  // namespace

void check(const Options& options) {
  options.common.check_gradients ? check_gradients(options) : check_stability(options);
}

void explain(const Options& options) {
  const TrainingPipeline all(options.shape, {}, group_names);
  const TrainingPipeline chosen(options.shape, {}, options.common.optimize);
  std::printf("%s\n", chosen.adjoints.explain().c_str());
  apps::print_left_out_groups(options.common, group_names);
  std::printf("the gradient has %zu stages; that by every group would have %zu\n", chosen.stages(),
              all.stages());
  std::printf("left out where a picture is demosaicked: the batch's dimension, and all of this\n");
}

}  // namespace demosaic
