// Tests the autoscheduler's search with artificial costs whose minimum is known.
#include "autoschedule/schedule_search.h"

#include <gtest/gtest.h>

#include <atomic>

#include "autodiff/derivative.h"
#include "diagnostics/error.h"
#include "frontend/language/func.h"
#include "gradient/gradient_check.h"
#include "support/same_numbers.h"

namespace retrograde {
namespace {

using autoschedule::ScheduleSearch;
using autoschedule::Scheduling;
using Funcs = std::vector<graph::FuncPtr>;

struct SearchOfSchedules : ::testing::Test {
  SearchOfSchedules() {
    const Buffer<float> image = gradient::random_image({96, 80}, -1, 1, 1);
    heavy(x, y) = exp(image(clamp(x, 0, 95), clamp(y, 0, 79)));
    curved(x, y) = sin(heavy(x, y)) + cos(heavy(x + 1, y)) * heavy(x, y + 1);
    const Func loss = gradient::weighted_sum(curved, {90, 70});
    outputs = {loss.function(), propagate_adjoints(loss)(image).function()};
  }
  ScheduleSearch search(const autoschedule::ScheduleCost& cost, size_t candidates = 0) const {
    return autoschedule::search_schedule(outputs, {}, Scheduling::Gradients, cost, candidates);
  }
  static std::string log_of(const Funcs& outputs) {
    return same_numbers(graph::schedule_log(outputs).to_text());
  }
  static int loops_of(const Funcs& outputs, ForType kind) {
    int count = 0;
    for (const graph::FuncPtr& f : graph::topological_order(outputs)) {
      for (int s = 0; s < f->stage_count(); ++s) {
        for (const graph::Dim& loop : f->stage(s).schedule.dims) count += loop.runs == kind;
      }
    }
    return count;
  }
  bool is_at_root(const Funcs& scheduled, const Func& f) const {
    for (const graph::FuncPtr& g : graph::topological_order(scheduled)) {
      if (g->name == f.name())
        return g->schedule.compute_level.kind == graph::LoopLevel::Kind::Root;
    }
    return false;
  }

  Var x{"x"}, y{"y"};
  Func heavy{"heavy"}, curved{"curved"};
  Funcs outputs;
};

TEST_F(SearchOfSchedules, ReturnsWhatTheRulesChooseWhereNothingIsBetter) {
  const ScheduleSearch found = search([](const Funcs&) { return 1.0; });
  EXPECT_EQ(found.best.cost, found.cost_of_rules);
  EXPECT_EQ(
      log_of(found.best.graph.outputs),
      log_of(autoschedule::schedule_within_budget(outputs, {}, Scheduling::Gradients).outputs));
  EXPECT_GT(found.tried, 3u);
}

TEST_F(SearchOfSchedules, FindsWhatTakesSeveralSteps) {
  const auto cost = [&](const Funcs& scheduled) {
    return (is_at_root(scheduled, heavy) ? 10.0 : 0.0) +
           (log_of(scheduled).find("rfactor") != std::string::npos ? 5.0 : 0.0);
  };
  const ScheduleSearch found = search(cost);
  EXPECT_EQ(found.cost_of_rules, 15);
  EXPECT_EQ(found.best.cost, 0);
  EXPECT_TRUE(found.best.request.options.without.contains(Decision::CutReductions));
  EXPECT_GE(found.runner_up.cost, found.best.cost);
  const std::string difference =
      autoschedule::difference_of(graph::schedule_log(found.best.graph.outputs),
                                  graph::schedule_log(found.runner_up.graph.outputs));
  EXPECT_NE(difference.find("+ "), std::string::npos) << difference;
}

TEST_F(SearchOfSchedules, IsTheSameEachTime) {
  const auto cost = [&](const Funcs& scheduled) {
    return 100.0 - loops_of(scheduled, ForType::Serial) % 7;
  };
  const ScheduleSearch first = search(cost), second = search(cost);
  EXPECT_EQ(log_of(first.best.graph.outputs), log_of(second.best.graph.outputs));
  EXPECT_EQ(first.tried, second.tried);
}

TEST_F(SearchOfSchedules, TriesAsManyAsItIsToldAndLeavesTheGraphAlone) {
  const std::string before = log_of(outputs);
  std::atomic<int> asked = 0;
  search([&](const Funcs&) { return static_cast<double>(100 - asked++); }, 5);
  EXPECT_EQ(asked, 6) << "with that of the rules";
  EXPECT_EQ(log_of(outputs), before);
}

TEST_F(SearchOfSchedules, LeavesOutWhatCannotBeCompiled) {
  std::atomic<int> asked = 0;
  const ScheduleSearch found = search([&](const Funcs&) -> double {
    if (asked++ > 0) user_error("compile it", "a made-up rule", "a made-up reason", "Nothing");
    return 3;
  });
  EXPECT_EQ(found.best.cost, 3);
  EXPECT_GT(asked, 3);
}

TEST_F(SearchOfSchedules, KeepsWhatAUserDecided) {
  autoschedule::ScheduleRequest request;
  request.options.without = {Decision::Strips};
  request.options.store = {FuncName(heavy)};
  const ScheduleSearch found = autoschedule::search_schedule(
      outputs, request, Scheduling::Gradients,
      [&](const Funcs& scheduled) { return is_at_root(scheduled, heavy) ? 2.0 : 1.0; });
  EXPECT_EQ(found.best.cost, 2);
  EXPECT_TRUE(found.best.request.options.without.contains(Decision::Strips));
}

// 500 stages and their gradient. chain_growth_test measures the time for one schedule.
TEST(SearchOfLongChains, TriesFewAndEnds) {
  EXPECT_EQ(autoschedule::candidates_for(10), 96u);
  EXPECT_EQ(autoschedule::candidates_for(1000), 12u);
  const Buffer<float> image = gradient::random_image({64, 64}, -1, 1, 1);
  Var x("x"), y("y");
  Func last("stage");
  last(x, y) = image(clamp(x, 0, 63), clamp(y, 0, 63));
  for (int i = 0; i < 250; ++i) {
    Func next("stage");
    next(x, y) = (last(x - 1, y) + last(x, y + 1)) * 0.5f;
    last = next;
  }
  const Func loss = gradient::weighted_sum(last, {60, 60});
  std::atomic<size_t> asked = 0;
  const ScheduleSearch found = autoschedule::search_schedule(
      {loss.function(), propagate_adjoints(loss)(image).function()}, {}, Scheduling::Gradients,
      [&](const Funcs& scheduled) {
        ++asked;
        return static_cast<double>(graph::schedule_log(scheduled).size());
      });
  EXPECT_LE(found.best.cost, found.cost_of_rules);
  EXPECT_GT(found.tried, 1u);
  EXPECT_LE(found.tried, 13u) << "with that of the rules";
  EXPECT_LE(asked, 13u);
}

}  // namespace
}  // namespace retrograde
