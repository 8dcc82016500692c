// Tests the fusion of loops over large images: partial sums of a loss, of gradients by parameters, and gradients by the
// image read the same pixels. They run in one loop over rows, with the results that each has on its own, and the same
// bits on any number of threads.
#include <gtest/gtest.h>

#include "autodiff/derivative.h"
#include "frontend/language/func.h"
#include "frontend/run/pipeline.h"
#include "gradient/gradient_check.h"
#include "graph/copy_graph.h"
#include "support/schedule_log.h"

namespace retrograde {
namespace {

constexpr int width = 1501, height = 1009, channels = 3;  // no multiples of vectors and parts

// A loss and the inputs by which it is differentiated.
struct Fit {
  Func loss;
  std::vector<Buffer<float>> inputs;
};

Buffer<float> pixels(double low, double high, uint32_t seed) {
  return gradient::random_image({width, height, channels}, low, high, seed);
}
Buffer<float> values(const std::vector<float>& all) {
  Buffer<float> result(static_cast<int>(all.size()));
  for (size_t i = 0; i < all.size(); ++i) result(static_cast<int>(i)) = all[i];
  return result;
}

// The mean of error(x, y, c) over all pixels.
Func mean(const Func& error) {
  Func loss("loss");
  RDom r(0, width, 0, height, 0, channels);
  loss() = 0.0f;
  loss() += error(r.x, r.y, r.z) * (1.0f / (width * height * channels));
  return loss;
}

// gain * picture^gamma + lift against a reference picture, differentiated by the picture too.
Fit tone_curve() {
  Var x("x"), y("y"), c("c");
  const Buffer<float> picture = pixels(0.05, 1, 1), wanted = pixels(0, 1, 2);
  const Buffer<float> gain = values({1.2f}), gamma = values({0.7f}), lift = values({0.02f});
  Func curve("curve"), error("error");
  curve(x, y, c) = gain(Expr(0)) * pow(picture(x, y, c), gamma(Expr(0))) + lift(Expr(0));
  error(x, y, c) = abs(curve(x, y, c) - wanted(x, y, c));
  return {mean(error), {picture, gain, gamma, lift}};
}

// A pixel mask, by a scale and a shift of each channel.
Fit logistic() {
  Var x("x"), y("y"), c("c");
  const Buffer<float> picture = pixels(-1, 1, 3), marks = pixels(0, 1, 4);
  const Buffer<float> scale = values({1.5f, 0.5f, -1}), shift = values({0.1f, 0, -0.2f});
  Func chance("chance"), error("error");
  chance(x, y, c) = 1.0f / (1.0f + exp(-(scale(c) * picture(x, y, c) + shift(c))));
  error(x, y, c) = -(marks(x, y, c) * log(chance(x, y, c)) +
                     (1.0f - marks(x, y, c)) * log(1.0f - chance(x, y, c)));
  return {mean(error), {picture, scale, shift}};
}

// Exposure in stops and a gain of each channel, with a loss that is robust to outliers.
Fit exposure() {
  Var x("x"), y("y"), c("c");
  const Buffer<float> picture = pixels(0, 1, 5), wanted = pixels(0, 1, 6);
  const Buffer<float> stops = values({0.4f}), gains = values({1.1f, 0.9f, 1.3f});
  Func exposed("exposed"), error("error");
  exposed(x, y, c) = 1.0f - exp(-pow(2.0f, stops(Expr(0))) * gains(c) * picture(x, y, c));
  const Expr difference = exposed(x, y, c) - wanted(x, y, c);
  error(x, y, c) = log(1.0f + 10.0f * difference * difference);
  return {mean(error), {stops, gains}};
}

// Counts whose rate is a softplus of a weighted sum of the measurements.
Fit softplus() {
  Var x("x"), y("y"), c("c");
  const Buffer<float> measured = pixels(-1, 1, 7), counts = pixels(0, 2, 8);
  const Buffer<float> weights = values({0.5f, -0.3f, 0.8f}), bias = values({0.1f});
  Func rate("rate"), error("error");
  rate(x, y, c) = log(1.0f + exp(weights(c) * measured(x, y, c) + bias(Expr(0))));
  error(x, y, c) = (rate(x, y, c) - counts(x, y, c)) * (rate(x, y, c) - counts(x, y, c));
  return {mean(error), {weights, bias}};
}

std::vector<Func> outputs(const Fit& fit) {
  const Derivative d = propagate_adjoints(fit.loss);
  std::vector<Func> result{fit.loss};
  for (const Buffer<float>& input : fit.inputs) result.push_back(d(input));
  return result;
}

std::vector<Buffer<float>> run(const Fit& fit, Pipeline pipeline, int threads = 0) {
  std::vector<Buffer<float>> results{Buffer<float>::make_scalar()};
  for (const Buffer<float>& input : fit.inputs)
    results.emplace_back(oracle::region_of(*Buffer<>(input).raw_buffer()).extents);
  pipeline.jit_handlers().thread_limit = threads;
  pipeline.realize(Realization(std::vector<Buffer<>>(results.begin(), results.end())));
  return results;
}

struct RowSweeps : ::testing::TestWithParam<Fit (*)()> {};

TEST_P(RowSweeps, HaveTheResultsOfSweepsApart) {
  const Fit fit = GetParam()();
  const std::vector<Func> funcs = outputs(fit);
  Pipeline apart(funcs);
  AutoscheduleOptions options;
  options.without = {Decision::JoinSweeps};
  apart.set_autoschedule(options);
  const auto expected = run(fit, apart);
  const auto found = run(fit, Pipeline(funcs), 1);
  EXPECT_NEAR(found[0](), expected[0](), 1e-6 * std::abs(expected[0]()));
  for (size_t k = 1; k < found.size(); ++k) {
    double largest = 0, difference = 0;
    found[k].for_each_element([&](const int* at) {
      largest = std::max<double>(largest, std::abs(expected[k](at)));
      difference = std::max<double>(difference, std::abs(found[k](at) - expected[k](at)));
    });
    EXPECT_LE(difference, 2e-6 * largest) << "gradient " << k;
  }
  for (const int threads : {2, 4}) {
    const auto again = run(fit, Pipeline(funcs), threads);
    for (size_t k = 0; k < found.size(); ++k)
      EXPECT_TRUE(gradient::same_bits(found[k], again[k])) << k << " on " << threads << " threads";
  }
}

TEST_P(RowSweeps, ShareALoopOverRows) {
  const Fit fit = GetParam()();
  Pipeline pipeline(outputs(fit));
  pipeline.auto_schedule(get_host_target());
  const ScheduleLog log = pipeline.schedule_log();
  EXPECT_TRUE(any_directive<graph::ComputeWith>(log)) << log.to_text();
}

INSTANTIATE_TEST_SUITE_P(Fits, RowSweeps,
                         ::testing::Values(tone_curve, logistic, exposure, softplus));

}  // namespace
}  // namespace retrograde
