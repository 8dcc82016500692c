// Tests sums at data-dependent indices. Where bits may differ from run to run, large scatters run in parallel by
// atomic updates; where they may not differ, none do.
#include <gtest/gtest.h>

#include <cstring>
#include <random>

#include "autodiff/derivative.h"
#include "frontend/include/retrograde/retrograde.h"
#include "support/loop_nest.h"
#include "support/schedule_log.h"

namespace retrograde {
namespace {

Buffer<int> random_places(int count, int below) {
  Buffer<int> places(count);
  std::mt19937 random(7);
  for (int i = 0; i < count; ++i)
    places(i) = static_cast<int>(random() % static_cast<unsigned>(below));
  return places;
}
Buffer<float> numbers(int count) {
  Buffer<float> values(count);
  for (int i = 0; i < count; ++i) values(i) = static_cast<float>(i % 37) / 37 + 0.01f;
  return values;
}

AutoscheduleOptions in_any_order() {
  AutoscheduleOptions options;
  options.deterministic = false;
  options.memory_budget = 48 << 20;
  return options;
}

bool is_atomic(const Pipeline& pipeline) {
  return any_directive<graph::MakeAtomic>(pipeline.schedule_log());
}

void expect_none(const Func& f, const AutoscheduleOptions& options) {
  const Pipeline pipeline(f);
  pipeline.auto_schedule(get_host_target(), options);
  EXPECT_FALSE(is_atomic(pipeline)) << pipeline.schedule_log().to_text();
}

// A table of a million floats, read two million times: its gradient is a scatter into eight privatised copies.
struct TableGradient {
  static constexpr int elements = 1 << 20, reads = 2 << 20;
  Buffer<float> table = numbers(elements), weights = numbers(reads);
  Buffer<int> places = random_places(reads, elements);
  Func read{"read"}, gradient;
  TableGradient() {
    Var x("x");
    read(x) = table(clamp(places(x), 0, elements - 1));
    gradient = propagate_adjoints(read, weights)(table);
  }
  Buffer<float> realized(const Pipeline& pipeline, int threads = 0) const {
    Pipeline mine = pipeline;
    mine.jit_handlers().thread_limit = threads;
    return mine.realize({elements});
  }
  // The expected gradient, summed term by term in double.
  std::vector<double> expected() const {
    std::vector<double> sums(elements);
    for (int i = 0; i < reads; ++i) sums[static_cast<size_t>(places(i))] += weights(i);
    return sums;
  }
};

size_t count_wrong(const Buffer<float>& found, const std::vector<double>& expected) {
  size_t wrong = 0;
  for (int i = 0; i < found.width(); ++i) {
    const double wanted = expected[static_cast<size_t>(i)];
    if (!(std::abs(found(i) - wanted) <= 1e-5 * (1 + std::abs(wanted)))) ++wrong;
  }
  return wrong;
}

TEST(AtomicScatters, PartsAreKeptWhereTheyAreWithinTheBudget) {
  const TableGradient program;
  AutoscheduleOptions options = in_any_order();
  options.memory_budget = 0;
  expect_none(program.gradient, options);
}

TEST(AtomicScatters, AreNeverChosenWhereBitsAreToBeTheSame) {
  const TableGradient program;
  AutoscheduleOptions options;
  options.memory_budget = 48 << 20;
  const Pipeline pipeline(program.gradient);
  pipeline.auto_schedule(get_host_target(), options);
  EXPECT_FALSE(is_atomic(pipeline)) << pipeline.schedule_log().to_text();
  const Buffer<float> one = program.realized(pipeline, 1), two = program.realized(pipeline, 2);
  EXPECT_EQ(std::memcmp(one.data(), two.data(), one.size_in_bytes()), 0);
}

TEST(AtomicScatters, GradientsAreCompiledSoToo) {
  const TableGradient program;
  Pipeline pipeline(program.gradient);
  pipeline.set_autoschedule(in_any_order());
  EXPECT_EQ(count_wrong(program.realized(pipeline), program.expected()), 0u);
}

// A forward histogram as a user writes it: it has no privatised copies.
struct Histogram {
  Func sums{"sums"};
  Histogram(const Buffer<int>& places, const Buffer<float>& weights, int bins) {
    Var x("x");
    RDom r(0, places.width());
    sums(x) = 0.0f;
    sums(clamp(places(r), 0, bins - 1)) += weights(r);
    sums.set_estimate(x, 0, bins);
  }
};

TEST(AtomicScatters, ALargeScatterRunsInParallel) {
  constexpr int bins = 1 << 16, count = (1 << 18) + 5;
  const Buffer<int> places = random_places(count, bins);
  const Buffer<float> weights = numbers(count);
  std::vector<double> expected(bins);
  for (int i = 0; i < count; ++i) expected[static_cast<size_t>(places(i))] += weights(i);
  const Histogram program(places, weights, bins);
  const Pipeline pipeline(program.sums);
  pipeline.auto_schedule(get_host_target(), in_any_order());
  EXPECT_TRUE(is_atomic(pipeline)) << pipeline.schedule_log().to_text();
  EXPECT_FALSE(names_in_nest(pipeline.loop_nest(), "parallel").empty());
  const Buffer<float> found = Pipeline(pipeline).realize({bins});
  EXPECT_EQ(count_wrong(found, expected), 0u);
}

TEST(AtomicScatters, FewElementsAreNotFoughtFor) {
  const Histogram program(random_places(1 << 18, 256), numbers(1 << 18), 256);
  expect_none(program.sums, in_any_order());
}

TEST(AtomicScatters, OneThreadNeedsNone) {
  const TableGradient program;
  AutoscheduleOptions options = in_any_order();
  options.threads = 1;
  expect_none(program.gradient, options);
}

}  // namespace
}  // namespace retrograde
