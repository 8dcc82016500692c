// The bytes that a pipeline copies between the host and the simulated device. An output that its
// kernels store entirely is never copied to the device, whatever its flags; otherwise all of the
// host's data is.
#include <HalideRuntime.h>
#include <gtest/gtest.h>
#include <retrograde/retrograde.h>

#include "simt/simt_driver.h"
#include "support/simulated_device.h"

namespace retrograde {
namespace {

constexpr int width = 64, height = 8;
constexpr int64_t picture_bytes = width * height * 4;

int64_t copied_to_device() {
  retrograde_simt_copied copied;
  retrograde_simt_count_copied(&copied);
  return copied.to_device;
}

class GpuCopies : public testing::Test {
 protected:
  GpuCopies() : in(width, height), result(width, height) {
    in.for_each_element([&](int i, int j) { in(i, j) = static_cast<float>(i + 10 * j); });
    result.fill(-1.0f);
  }

  // How many bytes are copied to the device while the result is computed.
  int64_t bytes_for(Func f) {
    const int64_t before = copied_to_device();
    f.realize(result, with_gpu());
    const int64_t bytes = copied_to_device() - before;
    EXPECT_FALSE(result.host_dirty());
    result.copy_to_host();
    return bytes;
  }
  template <typename Expected>
  void expect(Expected expected) {
    for (int j = 0; j < height; ++j) {
      for (int i = 0; i < width; ++i) ASSERT_EQ(result(i, j), expected(i, j)) << i << ", " << j;
    }
  }
  Func doubled() {
    Func out("out");
    out(x, y) = in(x, y) * 2.0f;
    out.gpu_tile(x, y, xi, yi, 16, 8);
    return out;
  }
  float doubled_at(int i, int j) const { return 2.0f * static_cast<float>(i + 10 * j); }

  Var x{"x"}, y{"y"}, xi{"xi"}, yi{"yi"};
  Buffer<float> in, result;
};

TEST_F(GpuCopies, AnOutputThatIsStoredWholeIsNotCopied) {
  EXPECT_EQ(bytes_for(doubled()), picture_bytes) << "the input alone";
  expect([&](int i, int j) { return doubled_at(i, j); });
  result.fill(-1.0f);
  ASSERT_TRUE(result.host_dirty());
  EXPECT_EQ(bytes_for(doubled()), 0);
  expect([&](int i, int j) { return doubled_at(i, j); });
}

TEST_F(GpuCopies, AnOutputThatIsStoredInPartIsCopied) {
  Func out("out");
  RDom r(0, width / 2, "r");
  out(x, y) = undef<float>();
  out(r.x, y) = in(r.x, y);
  out.gpu_tile(x, y, xi, yi, 16, 8);
  out.update().gpu_tile(r.x, y, RVar("ri"), yi, 16, 8);
  EXPECT_EQ(bytes_for(out), 2 * picture_bytes);
  expect([&](int i, int j) { return i < width / 2 ? in(i, j) : -1.0f; });
}

TEST_F(GpuCopies, WhatTheHostStoresInBetweenIsCopied) {
  Func out("out");
  out(x, y) = in(x, y);
  out(x, 0) += 1.0f;
  out(x, y) *= 2.0f;
  out.gpu_tile(x, y, xi, yi, 16, 8);
  out.update(1).gpu_tile(x, y, xi, yi, 16, 8);
  EXPECT_EQ(bytes_for(out), 2 * picture_bytes);
  expect([&](int i, int j) { return 2.0f * (in(i, j) + (j == 0 ? 1.0f : 0.0f)); });
}

TEST_F(GpuCopies, WhatTheHostStoresFirstIsCopied) {
  Func out("out");
  out(x, y) = in(x, y);
  out(x, y) += 3.0f;
  out.update().gpu_tile(x, y, xi, yi, 16, 8);
  EXPECT_EQ(bytes_for(out), picture_bytes);
  expect([&](int i, int j) { return in(i, j) + 3.0f; });
}

TEST_F(GpuCopies, AnOutputInManyLaunchesIsNotCopied) {
  Func out("out");
  out(x, y) = in(x, y) * 2.0f;
  out.gpu_tile(x, xi, 16);
  EXPECT_EQ(bytes_for(out), picture_bytes) << "a launch for each row";
  expect([&](int i, int j) { return doubled_at(i, j); });
}

TEST_F(GpuCopies, AnOutputThatIsAnInputIsCopied) {
  ImageParam given(Float(32), 2, "given");
  Func out("out");
  out(x, y) = given(x, y) * 3.0f;
  out.gpu_tile(x, y, xi, yi, 16, 8);
  result.for_each_element([&](int i, int j) { result(i, j) = in(i, j); });
  given.set(result);
  EXPECT_EQ(bytes_for(out), picture_bytes);
  expect([&](int i, int j) { return 3.0f * in(i, j); });
}

TEST_F(GpuCopies, ValuesOfATupleAreEachTheirOwn) {
  Func out("out");
  out(x, y) = Tuple(in(x, y) * 2.0f, in(x, y) + 1.0f);
  out.gpu_tile(x, y, xi, yi, 16, 8);
  Buffer<float> second(width, height);
  second.fill(-1.0f);
  const int64_t before = copied_to_device();
  out.realize({result, second}, with_gpu());
  EXPECT_EQ(copied_to_device() - before, picture_bytes);
  result.copy_to_host();
  second.copy_to_host();
  expect([&](int i, int j) { return doubled_at(i, j); });
  EXPECT_EQ(second(3, 2), in(3, 2) + 1.0f);
}

// A kernel that did not start has stored nothing, so the host's elements are still current.
TEST_F(GpuCopies, AnOutputOfAKernelThatDidNotStartKeepsItsElements) {
  Func out = doubled();
  out.compile_jit(with_gpu());
  retrograde_simt_fail_call("cuLaunchKernel", 1, 1);
  EXPECT_THROW(out.realize(result, with_gpu()), RuntimeError);
  EXPECT_TRUE(result.host_dirty());
  EXPECT_FALSE(result.device_dirty());
  Func sum("sum");
  sum(x, y) = result(x, y) + 5.0f;
  sum.gpu_tile(x, y, xi, yi, 16, 8);
  Buffer<float> other(width, height);
  sum.realize(other, with_gpu());
  other.copy_to_host();
  EXPECT_EQ(other(3, 2), 4.0f);
  EXPECT_EQ(bytes_for(out), 0);
  expect([&](int i, int j) { return doubled_at(i, j); });
}

}  // namespace
}  // namespace retrograde
