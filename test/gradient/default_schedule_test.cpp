// What lowering does with adjoints that nobody scheduled, and with those that somebody did.
#include "autodiff/default_schedule.h"

#include <gtest/gtest.h>

#include "autodiff/derivative.h"
#include "frontend/func.h"

namespace retrograde {
namespace {

struct DefaultSchedule : ::testing::Test {
  DefaultSchedule() {
    heavy(x, y) = exp(a(x, y)) * sin(a(x, y)) + cos(a(x, y));
    blur(x, y) = heavy(x, y) * heavy(x + 1, y) + heavy(x, y + 1);
    RDom r(0, 30, 0, 30);
    loss() = 0.0f;
    loss() += blur(r.x, r.y) * blur(r.x, r.y);
  }
  ir::DefaultSchedules choose(const Func& f) { return ir::default_schedules({f.function()}); }

  Buffer<float> a{32, 32};
  Var x{"x"}, y{"y"};
  Func heavy{"heavy"}, blur{"blur"}, loss{"loss"};
};

TEST_F(DefaultSchedule, LeavesPipelinesWithoutAdjointsAlone) { EXPECT_TRUE(choose(loss).empty()); }

TEST_F(DefaultSchedule, StoresWhatIsReadOftenAndCosts) {
  Derivative d = propagate_adjoints(loss);
  auto chosen = choose(d(a));
  ASSERT_TRUE(chosen.contains(heavy.function().get()));
  const ir::ChosenSchedule& schedule = chosen.at(heavy.function().get());
  EXPECT_EQ(schedule.func.compute_level.kind, ir::LoopLevel::Kind::Root);
  EXPECT_EQ(schedule.stages[0].dims.back().for_type, ForType::Parallel);
  EXPECT_EQ(schedule.stages[0].dims.front().for_type, ForType::Vectorized);
  EXPECT_EQ(heavy.function()->schedule.compute_level.kind, ir::LoopLevel::Kind::Inlined)
      << "the Func itself is not changed";
}

TEST_F(DefaultSchedule, ADirectiveOnAFuncSwitchesItOff) {
  Derivative d = propagate_adjoints(loss);
  Func adjoint = d(heavy);
  adjoint.compute_root();
  auto chosen = choose(d(a));
  EXPECT_FALSE(chosen.contains(adjoint.function().get()));
}

TEST_F(DefaultSchedule, AHandScheduleOfThePrimalKeepsItsInlinedFuncsInlined) {
  blur.compute_root();
  Derivative d = propagate_adjoints(loss);
  EXPECT_FALSE(choose(d(a)).contains(heavy.function().get()));
}

}  // namespace
}  // namespace retrograde
