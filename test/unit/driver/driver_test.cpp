// An unscheduled gradient has one schedule, whoever compiles it: in process, ahead of time, for a report, from Python.
//
// test/golden/driver/unscheduled_gradient.schedule is that schedule; test/python/autoschedule_test.py expects it, too.
// RETROGRADE_UPDATE_GOLDEN=1 writes the file instead; read the difference before you commit it.
#include "driver/schedule.h"

#include <gtest/gtest.h>
#include <retrograde/retrograde.h>

#include <cstdlib>
#include <fstream>
#include <regex>
#include <sstream>

#include "frontend/run/compiler_interface.h"

namespace retrograde {
namespace {

const Target avx2("x86-64-linux-avx-avx2-f16c-fma-sse41");

// The gradient of a sum of squares by the taps of the filter before it.
struct FilterGradient {
  ImageParam image{Float(32), 2, "image"}, taps{Float(32), 2, "taps"};
  Func filtered{"filtered"}, loss{"loss"}, gradient;
  FilterGradient() {
    const Var x("x"), y("y");
    const RDom near(0, 3, 0, 3, "near"), all(0, 640, 0, 480, "all");
    filtered(x, y) += image(x + near.x, y + near.y) * taps(near.x, near.y);
    loss() += filtered(all.x, all.y) * filtered(all.x, all.y);
    gradient = propagate_adjoints(loss)(taps);
    image.set_estimates({{0, 642}, {0, 482}});
  }
  Pipeline pipeline() const { return Pipeline(gradient); }
};

// Numbers in the names of generated Funcs and loops differ from copy to copy.
std::string without_numbers(const std::string& text) {
  return std::regex_replace(text, std::regex("([A-Za-z])([$_][0-9]+)+"), "$1");
}

// The loops that the compilation builds.
std::string loops_of(const std::function<void()>& compile) {
  std::string loops;
  const PassObserver observer([&](const PassReport& report) {
    if (report.pass == "build_loop_nests") loops = without_numbers(report.text());
  });
  compile();
  return loops;
}

TEST(Driver, InProcessAndAheadOfTimeHaveTheSameLoops) {
  const FilterGradient program;
  const Target target = get_host_target();
  const std::string in_process = loops_of([&] { program.pipeline().compile_jit(target); });
  const std::string ahead_of_time = loops_of([&] {
    program.pipeline().compile_to_module({program.image, program.taps}, "gradient", target);
  });
  EXPECT_NE(in_process.find("parallel"), std::string::npos) << in_process;
  EXPECT_EQ(in_process, ahead_of_time);
}

TEST(Driver, OptionsApplyAheadOfTime) {
  const FilterGradient program;
  const Target target = get_host_target();
  const auto ahead_of_time = [&](const AutoscheduleOptions& options) {
    Pipeline pipeline = program.pipeline();
    pipeline.set_autoschedule(options);
    return loops_of([&] {
      pipeline.compile_to_module({program.image, program.taps}, "gradient", target);
    });
  };
  Pipeline on_one_thread = program.pipeline();
  on_one_thread.set_autoschedule({.threads = 1});
  const std::string in_process = loops_of([&] { on_one_thread.compile_jit(target); });
  EXPECT_EQ(ahead_of_time({.threads = 1}), in_process);
  EXPECT_NE(ahead_of_time({}), in_process);
}

TEST(Driver, EveryCallerGetsTheSameSchedule) {
  FilterGradient program;
  program.gradient.set_estimates({{0, 3}, {0, 3}});
  const Pipeline pipeline = program.pipeline();
  const std::string schedule = without_numbers(pipeline.explain_schedule(avx2).schedule);
  EXPECT_EQ(without_numbers(default_compiler().schedule(pipeline.spec(), avx2).to_cpp()), schedule);
  EXPECT_EQ(without_numbers(
                graph::schedule_log(driver::schedule_unscheduled({program.gradient.function()},
                                                                 driver::request_for(avx2, {})))
                    .to_cpp()),
            schedule);
  const std::string path = RETROGRADE_TEST_DIR "/golden/driver/unscheduled_gradient.schedule";
  if (std::getenv("RETROGRADE_UPDATE_GOLDEN")) std::ofstream(path) << schedule;
  std::ostringstream expected;
  expected << std::ifstream(path).rdbuf();
  EXPECT_EQ(schedule, expected.str());
}

// A user's schedule stays in a copy; without one, the copy gets that of auto_schedule().
TEST(Driver, CopiesKeepAUsersSchedule) {
  FilterGradient program;
  const auto log_of = [&](const Pipeline& p) { return without_numbers(p.schedule_log().to_cpp()); };
  const Pipeline scheduled = driver::scheduled_copy(program.pipeline(), avx2);
  EXPECT_EQ(program.pipeline().schedule_log().size(), 0u);
  EXPECT_NE(log_of(scheduled).find("parallel"), std::string::npos);
  program.filtered.compute_root();
  EXPECT_EQ(log_of(driver::scheduled_copy(program.pipeline(), avx2)), log_of(program.pipeline()));
}

}  // namespace
}  // namespace retrograde
