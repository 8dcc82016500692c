// Barriers counted by the simulated device: warp barriers replace block barriers where they
// suffice, and loops that alternate between two halves of an array need none in between.
#include <gtest/gtest.h>
#include <retrograde/retrograde.h>

#include <functional>

#include "simt/simt_driver.h"
#include "support/simulated_device.h"

namespace retrograde {
namespace {

constexpr int width = 128, height = 8;

class GpuBarriers : public testing::Test {
 protected:
  GpuBarriers() : in(width + 1, height) {
    in.for_each_element([&](int i, int j) { in(i, j) = static_cast<float>((i * 7 + j * 3) % 16); });
  }
  void TearDown() override {
    choose(retrograde_simt_forward, false);
    retrograde_simt_reset_profile();
  }
  static void choose(int order, bool profile) {
    retrograde_simt_options options;
    retrograde_simt_get_options(&options);
    options.order = order;
    options.profile = profile;
    retrograde_simt_set_options(&options);
  }

  // Checks the result in all thread orders; returns the counts of one run.
  static retrograde_simt_profile counted(const std::function<Func(bool on_gpu)>& build,
                                         const std::vector<int>& sizes) {
    const Buffer<float> expected = build(false).realize(sizes, get_host_target());
    Func f = build(true);
    retrograde_simt_profile counts = {};
    for (int order = retrograde_simt_forward; order <= retrograde_simt_warp_ahead; ++order) {
      choose(order, true);
      retrograde_simt_reset_profile();
      const Buffer<float> got = f.realize(sizes, with_gpu());
      for (size_t i = 0; i < got.number_of_elements(); ++i)
        EXPECT_EQ(got.data()[i], expected.data()[i]) << "element " << i << ", order " << order;
      retrograde_simt_get_profile(nullptr, &counts);
    }
    return counts;
  }

  Var x{"x"}, y{"y"}, xi{"xi"}, yi{"yi"};
  Buffer<float> in;
};

// Rows of 32 points, each reversed.
TEST_F(GpuBarriers, RowsOfWarpsWaitForTheirOwnWarp) {
  const auto build = [&](bool on_gpu) {
    Func line("line"), out("out");
    line(x, y) = in(x, y) * 2.0f;
    out(x, y) = line(x / 32 * 32 + (31 - x % 32), y);
    out.bound(x, 0, width).bound(y, 0, height);
    if (on_gpu) {
      out.gpu_tile(x, y, xi, yi, 32, 4);
      line.compute_at(out, x).gpu_threads(x, y);
    }
    return out;
  };
  const retrograde_simt_profile counts = counted(build, {width, height});
  EXPECT_EQ(counts.barriers, 0);
  EXPECT_EQ(counts.warp_barriers, width / 32 * height) << "one for each warp";
}

TEST_F(GpuBarriers, ABlockOfOneWarpHasNoOthers) {
  const auto build = [&](bool on_gpu) {
    Func line("line"), out("out");
    line(x, y) = in(x, y) * 2.0f;
    out(x, y) = line(x, y) + line(x + 1, y);
    if (on_gpu) {
      out.gpu_tile(x, xi, 16);
      line.compute_at(out, x).gpu_threads(x);
    }
    return out;
  };
  const retrograde_simt_profile counts = counted(build, {width, height});
  EXPECT_EQ(counts.barriers, 0);
  EXPECT_EQ(counts.warp_barriers, width / 16 * height);
}

// A sum over rows in each block's shared memory, one or two rows at a time.
TEST_F(GpuBarriers, TwoRowsInTurnTakeHalfOfTheBarriers) {
  const auto build = [&](int rows) {
    return [this, rows](bool on_gpu) {
      RDom r(0, height, "r");
      Func row("row"), sum("sum"), out("out");
      row(x, y) = in(x, y);
      sum(x) = 0.0f;
      sum(x) += row(x, r) * row(x + 1, r);
      out(x) = sum(x);
      if (on_gpu) {
        out.gpu_tile(x, xi, 64);
        sum.compute_at(out, x).store_in(MemoryType::Register).gpu_threads(x);
        sum.update().reorder(x, r).gpu_threads(x);
        row.store_at(out, x).compute_at(sum, r).gpu_threads(x).fold_storage(y, rows);
      }
      return out;
    };
  };
  const int blocks = width / 64;
  EXPECT_EQ(counted(build(1), {width}).barriers, 2 * height * blocks);
  EXPECT_EQ(counted(build(2), {width}).barriers, height * blocks);
}

}  // namespace
}  // namespace retrograde
