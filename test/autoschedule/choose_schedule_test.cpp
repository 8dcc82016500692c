// Tests schedules that a search finds by predicted time: they are legal, right, and never predicted to be slower than
// the default schedules. Also tests the report on the runner-up, and on programs that cannot be searched.
#include "driver/choose_schedule.h"

#include <gtest/gtest.h>

#include <regex>

#include "autodiff/derivative.h"
#include "frontend/include/retrograde/retrograde.h"
#include "gradient/gradient_check.h"
#include "support/loop_nest.h"

namespace retrograde {
namespace {

using gradient::random_image;

AutoscheduleOptions searching() {
  AutoscheduleOptions options;
  options.search = true;
  return options;
}

// Edge-preserving denoising, the weighted sum of its result, and the gradient of that sum.
struct Smoothing {
  static constexpr int width = 300, height = 200;
  Buffer<float> image = random_image({width, height}, -1, 1, 1);
  Var x{"x"}, y{"y"};
  Func heavy{"heavy"}, weighted{"weighted"}, loss, gradient;
  Smoothing() {
    const Func padded = BoundaryConditions::repeat_edge(image);
    heavy(x, y) = exp(-abs(padded(x, y) - padded(x + 1, y)));
    RDom near(-3, 7);
    weighted(x, y) = 0.0f;
    weighted(x, y) += heavy(x + near, y) * padded(x, y + near);
    loss = gradient::weighted_sum(weighted, {width - 6, height - 6});
    gradient = propagate_adjoints(loss)(image);
  }
  Pipeline pipeline() const { return Pipeline({loss, gradient}); }
  std::vector<Buffer<float>> realized(Pipeline p) const {
    std::vector<Buffer<float>> out{Buffer<float>::make_scalar(), Buffer<float>(width, height)};
    p.realize({out[0], out[1]});
    return out;
  }
};

// Removes the numbers in names of generated Funcs, which differ from build to build.
std::string without_numbers(const std::string& source) {
  return std::regex_replace(source, std::regex("_[0-9][0-9]+"), "");
}

void expect_agreement(const Buffer<float>& a, const Buffer<float>& b) {
  size_t wrong = 0;
  a.for_each_element([&](const int* at) {
    if (!(std::abs(a(at) - b(at)) <= 1e-4 * (1 + std::abs(a(at))))) ++wrong;
  });
  EXPECT_EQ(wrong, 0u);
}

TEST(ChooseSchedule, AGradientIsCompiledAsTheSearchHasIt) {
  const Smoothing by_default, searched;
  const auto expected = by_default.realized(by_default.pipeline());
  Pipeline pipeline = searched.pipeline();
  pipeline.set_autoschedule(searching());
  const auto found = searched.realized(pipeline);
  for (size_t i = 0; i < found.size(); ++i) expect_agreement(expected[i], found[i]);
  const SearchedSchedules search = pipeline.explain_schedule().search;
  EXPECT_GT(search.tried, 10u);
  EXPECT_LE(search.predicted_ms, search.default_ms);
  EXPECT_TRUE(search.note.empty()) << search.note;
}

TEST(ChooseSchedule, APipelineGetsDirectivesOfTheBest) {
  const Smoothing program;
  const Pipeline pipeline = program.pipeline();
  const AutoSchedulerResults results = pipeline.auto_schedule(get_host_target(), searching());
  EXPECT_GT(results.search.tried, 10u);
  EXPECT_LE(results.search.predicted_ms, results.search.default_ms);
  const Smoothing by_default;
  const auto expected = by_default.realized(by_default.pipeline());
  const auto found = program.realized(pipeline);
  for (size_t i = 0; i < found.size(); ++i) expect_agreement(expected[i], found[i]);
  // The log describes the chosen schedule: applied as user directives, it gives the same prediction.
  EXPECT_NEAR(pipeline.explain_schedule().predicted_ms, results.search.predicted_ms,
              1e-3 * results.search.predicted_ms);
}

TEST(ChooseSchedule, TheSameProgramHasTheSameSchedule) {
  std::string first;
  for (int i = 0; i < 2; ++i) {
    const Smoothing program;
    const auto results = program.pipeline().auto_schedule(get_host_target(), searching());
    const std::string text = without_numbers(results.schedule_source);
    if (first.empty()) first = text;
    EXPECT_EQ(first, text);
  }
}

TEST(ChooseSchedule, TheReportShowsTheRunnerUp) {
  const Smoothing program;
  Pipeline pipeline = program.pipeline();
  const ScheduleReport plain = pipeline.explain_schedule();
  EXPECT_EQ(plain.search.tried, 0u);
  EXPECT_EQ(plain.to_string().find("runner-up"), std::string::npos);
  const ScheduleReport asked = pipeline.explain_schedule(Target(), {}, {.runner_up = true});
  EXPECT_EQ(without_numbers(asked.schedule), without_numbers(plain.schedule))
      << "stays with the default";
  EXPECT_NEAR(asked.search.predicted_ms, plain.predicted_ms, 1e-9);
  ASSERT_TRUE(asked.search.runner_up_ms.has_value());
  EXPECT_GT(*asked.search.runner_up_ms, 0);
  const std::string text = asked.to_string();
  for (const char* part : {"runner-up: ", "searched: ", "\n+ "})
    EXPECT_NE(text.find(part), std::string::npos) << part << " is not in\n" << text;
  EXPECT_NE(asked.to_json().find("\"runner_up_ms\""), std::string::npos);
}

// Nothing fails, but the report has the parts of an error.
TEST(ChooseSchedule, WithoutSizesTheDefaultIsKept) {
  ImageParam image(Float(32), 2, "unsized");
  Func out("of_unsized");
  Var x("x"), y("y");
  out(x, y) = exp(image(x, y)) + image(x + 1, y);
  const auto results = Pipeline(out).auto_schedule(get_host_target(), searching());
  EXPECT_EQ(results.search.tried, 0u);
  EXPECT_EQ(
      results.search.note,
      "cannot search for a schedule of \"of_unsized\": sizes of images and outputs are known or "
      "estimated; the extent of dimension 0 of \"unsized\" is not known, so that the default "
      "schedule is taken. Give set_estimates() or bind the image.");
  EXPECT_FALSE(results.schedule_source.empty());
}

TEST(ChooseSchedule, OutputsWithoutSizesAreNamed) {
  Func out("endless");
  Var x("x");
  out(x) = cast<float>(x);
  const auto results = Pipeline(out).auto_schedule(get_host_target(), searching());
  EXPECT_EQ(
      results.search.note,
      "cannot search for a schedule of \"endless\": sizes of images and outputs are known or "
      "estimated; the extent of \"x\" of \"endless\" is not known, so that the default schedule "
      "is taken. Give set_estimates() or bind the image.");
}

TEST(ChooseSchedule, WhatIsScheduledIsNotSearched) {
  const Smoothing program;
  Pipeline pipeline = program.pipeline();
  pipeline.auto_schedule(get_host_target());
  const ScheduleReport report = pipeline.explain_schedule(Target(), {}, {.runner_up = true});
  EXPECT_EQ(report.search.tried, 0u);
  EXPECT_EQ(graph::without_numbers(report.search.note),
            "cannot search for a schedule of \"loss\", \"b_adj\": a search is for what nobody "
            "scheduled; every Func has a directive, so that the default schedule is taken. Search "
            "before anything else schedules them.");
}

TEST(ChooseSchedule, ForwardProgramsAreSearchedWhenTheyAreScheduled) {
  Func out("forward");
  Var x("x");
  out(x) = cast<float>(x);
  out.set_estimate(x, 0, 100);
  Pipeline pipeline(out);
  pipeline.set_autoschedule(searching());
  EXPECT_EQ(
      pipeline.explain_schedule().search.note,
      "cannot search for a schedule of \"forward\": compiling searches schedules of gradients; "
      "none of its Funcs is one, so that the default schedule is taken. Call auto_schedule() "
      "with these options.");
}

TEST(ChooseSchedule, OverridesHoldInASearch) {
  Smoothing program;
  AutoscheduleOptions options = searching();
  options.store = {program.heavy};
  options.threads = 1;
  const Pipeline pipeline = program.pipeline();
  pipeline.auto_schedule(get_host_target(), options);
  EXPECT_EQ(program.heavy.function()->schedule.compute_level.kind, graph::LoopLevel::Kind::Root);
  EXPECT_EQ(names_in_nest(pipeline.loop_nest(), "parallel"), std::vector<std::string>());
}

}  // namespace
}  // namespace retrograde
