// Pipeline::auto_schedule() without a plugin: its decisions on inlining and storage.
#include <gtest/gtest.h>

#include <retrograde/retrograde.h>

#include <functional>
#include <regex>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "graph/graph.h"
#include "ir/target.h"
#include "support/errors.h"
#include "support/loop_nest.h"

namespace retrograde {
namespace {

struct BuiltInScheduler : ::testing::Test {
  BuiltInScheduler() {
    brighter(x, y) = input(x, y) * 1.5f + 0.25f;
    heavy(x, y) = exp(brighter(x, y)) * sin(brighter(x, y));
    blur(x, y) = heavy(x - 1, y) + heavy(x, y) + heavy(x + 1, y);
    sums(x) = 0.0f;
    sums(x) += blur(x, rows);
    out(x) = sums(x) * 2.0f;
    out.set_estimate(x, 0, 1000);
  }
  std::string schedule() { return Pipeline(out).auto_schedule(get_host_target()).schedule_source; }
  static bool is_at_root(const Func& f) {
    return f.function()->schedule.compute_level.kind == graph::LoopLevel::Kind::Root;
  }
  static ForType outermost(const Func& f) { return f.get_schedule().dims.back().runs; }
  static ForType innermost(const Func& f) { return f.get_schedule().dims.front().runs; }

  ImageParam input{Float(32), 2, "input"};
  Var x{"x"}, y{"y"};
  RDom rows{0, 100, "rows"};
  Func brighter{"brighter"}, heavy{"heavy"}, blur{"blur"}, sums{"sums"}, out{"out"};
};

TEST_F(BuiltInScheduler, InlinesWhatIsCheapAndStoresTheRest) {
  EXPECT_EQ(Pipeline(out).auto_schedule(get_host_target()).scheduler_name, built_in_autoscheduler);
  EXPECT_FALSE(is_at_root(brighter));
  EXPECT_TRUE(is_at_root(heavy));
  EXPECT_TRUE(is_at_root(sums));
  EXPECT_TRUE(is_at_root(out));
  EXPECT_EQ(outermost(heavy), ForType::Parallel);
  EXPECT_EQ(innermost(heavy), ForType::Vectorized);
}

TEST_F(BuiltInScheduler, KeepsWhatAUserScheduled) {
  heavy.compute_at(blur, y).vectorize(x, 4);
  blur.compute_root().reorder(y, x);
  const ScheduleLog given = Pipeline(out).schedule_log();
  const std::string source = schedule();
  EXPECT_EQ(source.find("heavy"), std::string::npos) << source;
  EXPECT_EQ(source.find("blur."), std::string::npos) << source;
  EXPECT_EQ(Pipeline(out).schedule_log().first(given.size()), given);
}

TEST_F(BuiltInScheduler, MovesNothingOutOfTheLoopsThatItNeeds) {
  Func inside("inside"), between("between"), last("last");
  inside(x) = exp(input(x, 0));
  between(x) = exp(inside(x)) * sin(inside(x));
  last(x) = between(x) + between(x + 1) + between(x + 2);
  inside.compute_at(last, x);
  Pipeline(last).auto_schedule(get_host_target());
  EXPECT_FALSE(is_at_root(between));
  EXPECT_NO_THROW(Pipeline(last).loop_nest());
}

TEST_F(BuiltInScheduler, LeavesInlineWhatIsReadAtPlacesWithoutBounds) {
  ImageParam place(Int(32), 1, "place");
  Func computed("computed"), read("read");
  computed(x) = exp(cast<float>(x)) * sin(cast<float>(x));
  read(x) = computed(place(x)) + computed(place(x) + 1) + computed(place(x) + 2);
  Pipeline(read).auto_schedule(get_host_target());
  EXPECT_FALSE(is_at_root(computed));
  EXPECT_NO_THROW(Pipeline(read).compile_jit());
}

TEST_F(BuiltInScheduler, SchedulesGradients) {
  Func loss("loss");
  RDom all(0, 1000);
  loss() = 0.0f;
  loss() += out(all) * out(all);
  Pipeline gradient({propagate_adjoints(loss, {.wrt = {input}})(input)});
  const std::string by_default = gradient.loop_nest();
  gradient.auto_schedule(get_host_target());
  EXPECT_EQ(gradient.loop_nest(), by_default);
}

TEST_F(BuiltInScheduler, UnscheduledGradientsStaySo) {
  Func loss("loss");
  RDom all(0, 1000);
  loss() = 0.0f;
  loss() += out(all) * out(all);
  Pipeline gradient({propagate_adjoints(loss, {.wrt = {input}})(input)});
  EXPECT_FALSE(names_in_nest(gradient.loop_nest(), "parallel").empty());
  gradient.unscheduled();
  EXPECT_EQ(names_in_nest(gradient.loop_nest(), "parallel"), std::vector<std::string>());
}

}  // namespace
}  // namespace retrograde
