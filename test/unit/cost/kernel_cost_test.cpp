// Prices of kernels, compared with figures that are computed by hand for the default device: 200 bytes a nanosecond from
// memory and 1000 from first caches, 32768 threads, 4 us for a launch.
#include <gtest/gtest.h>

#include "frontend/data/param.h"
#include "unit/cost/cost_testing.h"

namespace retrograde::planning {
namespace {

const std::string rows_of_32 = "block y:4 GuardWithIf, block x:32 GuardWithIf, thread y, thread x";

Cost priced_kernels(const std::vector<Func>& outputs, const std::string& plan) {
  const Device device;
  const ProgramPtr program = make_program(functions(outputs));
  const AccessGraph accesses(functions(outputs));
  const SizeModel sizes(accesses, {unknown_extent});
  const Machine machine = probed_machine();
  return CostModel(accesses, sizes, machine, &device).price(parsed(plan, program));
}

struct Picture {
  Picture() {
    for (int d = 0; d < 2; ++d) im.dim(d).set_estimate(0, 1024);
  }
  Func result(const Expr& value) {
    Func f("out");
    f(x, y) = value;
    f.set_estimate(x, 0, 1024).set_estimate(y, 0, 1024);
    return f;
  }
  Var x{"x"}, y{"y"};
  ImageParam im{Float(32), 2, "im"};
};

constexpr double picture_bytes = 4.0 * 1024 * 1024;

TEST(CostOfKernels, IsThatOfMemoryAndALaunch) {
  Picture p;
  const Cost cost = priced_kernels({p.result(p.im(p.x, p.y) + 1.0f)}, "out  root  " + rows_of_32);
  ASSERT_EQ(cost.stages.size(), 1u);
  EXPECT_EQ(cost.stages[0].bytes.back(), 2 * picture_bytes);
  EXPECT_NEAR(cost.seconds, (2 * picture_bytes / 200 / 1000 + 4) * micro, 1 * micro);
  EXPECT_EQ(cost.stages[0].bound_by(), "memory");
}

// Each thread of a warp reads a line of its own: 32 lines of 64 bytes, beside two that the warp writes.
TEST(CostOfKernels, RisesWithTheLinesOfAWarp) {
  Picture p;
  const Cost cost = priced_kernels({p.result(p.im(p.y, p.x))}, "out  root  " + rows_of_32);
  const double warps = 1024 * 1024 / 32;
  EXPECT_NEAR(cost.seconds, ((32 + 2) * 64 * warps / 1000 / 1000 + 4) * micro, 1 * micro);
}

// A warp is a 1024th of the device's threads.
TEST(CostOfKernels, RisesWhereFewThreadsWait) {
  Picture p;
  const Cost all = priced_kernels({p.result(p.im(p.x, p.y))}, "out  root  " + rows_of_32);
  const Cost one = priced_kernels({p.result(p.im(p.x, p.y))}, "out  root  block once, y, x");
  EXPECT_GT(one.seconds, 900 * (all.seconds - 4 * micro));
}

TEST(CostOfKernels, CountsNoLaunchForWhatRunsInThreads) {
  Picture p;
  Func mean("mean");
  RDom r(0, 16, "r");
  mean(p.x, p.y) = 0.0f;
  mean(p.x, p.y) += p.im(p.x + r, p.y);
  const Func out = p.result(max(mean(p.x, p.y), 0.0f));
  const auto launches = [&](const std::string& mean_plan) {
    const Cost cost = priced_kernels({out}, "out  root  " + rows_of_32 + "\n" + mean_plan);
    double sum = 0;
    for (const StageCost& stage : cost.stages) sum += stage.launch_seconds;
    return sum / micro;
  };
  EXPECT_NEAR(
      launches("mean  root\n  .0  " + rows_of_32 + "\n  .1  " + rows_of_32 + ", " + r.x.name()), 12,
      1e-9);
  EXPECT_NEAR(launches("mean  at out/x\n  .0  y, x\n  .1  y, x, " + r.x.name()), 4, 1e-9);
}

}  // namespace
}  // namespace retrograde::planning
