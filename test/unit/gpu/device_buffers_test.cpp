// Front-end Buffers with memory on the simulated device: copies according to the dirty flags, crops
// and slices, and errors where the runtime would end the process.
#include <gtest/gtest.h>
#include <retrograde/retrograde.h>

#include "simt/simt_driver.h"
#include "support/errors.h"
#include "support/simulated_device.h"

namespace retrograde {
namespace {

int64_t uploads() { return retrograde_simt_call_count("cuMemcpyHtoDAsync_v2"); }

Buffer<int> ramp(int width, int height) {
  Buffer<int> b(width, height, "b");
  b.for_each_element([&](int x, int y) { b(x, y) = x + 100 * y; });
  return b;
}

// Imitates a kernel: the device holds the contents of `b`, and the host's elements are stale.
void move_to_device(Buffer<int>& b) {
  b.copy_to_device();
  auto& host = *b.get();
  host.fill(-1);
  host.set_host_dirty(false);
  b.set_device_dirty();
}

TEST(DeviceBuffers, CopiesWhereTheFlagsAsk) {
  Buffer<int> b = ramp(20, 10);
  EXPECT_TRUE(b.host_dirty()) << "whoever gets a reference to an element may write";
  b.copy_to_device();
  EXPECT_TRUE(b.has_device_allocation());
  EXPECT_FALSE(b.host_dirty());
  const int64_t before = uploads();
  b.copy_to_device(with_gpu());
  b.copy_to_device(DeviceAPI::CUDA);
  EXPECT_EQ(uploads(), before);
  b(3, 2) = 5;
  b.copy_to_device();
  EXPECT_EQ(uploads(), before + 1);
  move_to_device(b);
  b.copy_to_host();
  EXPECT_FALSE(b.device_dirty());
  EXPECT_EQ(b(4, 2), 204);
  EXPECT_EQ(b(3, 2), 5);
  b.set_host_dirty(false);
  b.device_free();
  EXPECT_FALSE(b.has_device_allocation());
}

TEST(DeviceBuffers, CropsAndSlicesAreParts) {
  Buffer<int> b = ramp(20, 10);
  move_to_device(b);
  Buffer<int> part = b.cropped(0, 4, 3).cropped(1, 5, 2);
  Buffer<int> row = b.sliced(1, 7);
  EXPECT_TRUE(part.device_dirty());
  part.copy_to_host();
  EXPECT_EQ(part(4, 5), 504);
  row.copy_to_host();
  EXPECT_EQ(row(3), 703);
  expect_error<RuntimeError>({"device_free", "\"b", "no other Buffer may use its device memory"},
                             [&] { b.device_free(); });
  expect_error<RuntimeError>({"only memory that the Buffer allocated is freed"},
                             [&] { part.device_free(); });
}

TEST(DeviceBuffers, ErrorsGoToTheHandlerOfTheContext) {
  struct Told : JITUserContext {
    std::string text;
  } context;
  Buffer<int> b = ramp(20, 10);
  EXPECT_EQ(b.copy_to_device(with_gpu(), &context), 0);
  EXPECT_EQ(b.copy_to_host(&context), 0);
  EXPECT_EQ(b.device_sync(&context), 0);
  Buffer<int> part = b.cropped(0, 4, 3);
  EXPECT_THROW(b.device_free(&context), RuntimeError) << "the context has no handler";
  context.handlers.custom_error = [](JITUserContext* to, const char* text) {
    static_cast<Told*>(to)->text = text;
  };
  EXPECT_EQ(b.device_free(&context), halide_error_code_device_free_failed);
  expect_mentions(context.text, {"device_free", "no other Buffer may use its device memory"});
  EXPECT_TRUE(b.has_device_allocation());
}

TEST(DeviceBuffers, TheLastHandleFreesWhatIsNewerThere) {
  const int64_t before = retrograde_simt_call_count("cuMemAlloc_v2");
  {
    Buffer<int> b = ramp(20, 10);
    move_to_device(b);
    const Buffer<int> again = b;
    b = Buffer<int>();
    EXPECT_TRUE(again.device_dirty());
  }
  Buffer<int> other = ramp(20, 10);
  other.copy_to_device();
  EXPECT_LE(retrograde_simt_call_count("cuMemAlloc_v2"), before + 1) << "its memory was not kept";
}

TEST(DeviceBuffers, WrapsWhatIsTheCallers) {
  Buffer<int> owner = ramp(20, 10);
  owner.copy_to_device();
  Buffer<int> b(20, 10);
  const uint64_t there = owner.get()->raw_buffer()->device;
  b.device_wrap_native(DeviceAPI::CUDA, there);
  EXPECT_EQ(b.get()->raw_buffer()->device, there);
  expect_error<RuntimeError>({"device_wrap_native", "one device memory at a time"},
                             [&] { b.device_wrap_native(DeviceAPI::CUDA, there); });
  expect_error<RuntimeError>({"only memory that the Buffer allocated is freed"},
                             [&] { b.device_free(); });
  b.set_device_dirty();
  b.copy_to_host();
  EXPECT_EQ(b(7, 3), 307);
  b.set_host_dirty(false);
  b.device_detach_native();
  EXPECT_FALSE(b.has_device_allocation());
  expect_error<RuntimeError>({"only memory that was wrapped is detached"},
                             [&] { owner.device_detach_native(); });
}

TEST(DeviceBuffers, WhatIsNewerOnTheDeviceIsNotReadOnTheHost) {
  Buffer<int> b = ramp(20, 10);
  move_to_device(b);
  const char* rule = "its newest elements must be on the host";
  expect_error<RuntimeError>({"copy()", rule, "copy_to_host()"}, [&] { b.copy(); });
  expect_error<RuntimeError>({"fill", rule}, [&] { b.fill(3); });
  expect_error<RuntimeError>({"translate", rule}, [&] { b.translate(0, 3); });
  expect_error<RuntimeError>({"all_equal", rule}, [&] { (void)b.all_equal(3); });
  expect_error<RuntimeError>({"set_host_dirty", rule}, [&] { b.set_host_dirty(); });
  Buffer<int> other(20, 10);
  expect_error<RuntimeError>({"copy_from", rule}, [&] { other.copy_from(b); });
  b.copy_to_host();
  EXPECT_EQ(b.copy()(1, 1), 101);
  b.set_host_dirty();
  expect_error<RuntimeError>({"set_device_dirty", "must not be on the host alone"},
                             [&] { b.set_device_dirty(); });
}

TEST(DeviceBuffers, PipelinesOfBothSidesFollowEachOther) {
  Var x("x"), y("y"), xi("xi"), yi("yi");
  ImageParam in(Int(32), 2, "in");
  Func twice("twice"), more("more");
  twice(x, y) = in(x, y) * 2;
  twice.gpu_tile(x, y, xi, yi, 8, 8);
  more(x, y) = in(x, y) + 1;
  const Buffer<int> first = ramp(20, 10);
  Buffer<int> second(20, 10), third(20, 10);
  in.set(first);
  more.realize(second);
  in.set(second);
  twice.realize(third, with_gpu());
  EXPECT_TRUE(third.device_dirty());
  in.set(third);
  twice.realize(second, with_gpu());
  third.copy_to_host();
  second.copy_to_host();
  EXPECT_EQ(third(3, 2), 2 * 204);
  EXPECT_EQ(second(3, 2), 4 * 204);
  in.set(second);
  more.realize(third);
  in.set(third);
  twice.realize(second, with_gpu());
  second.copy_to_host();
  EXPECT_EQ(second(3, 2), 2 * (4 * 204 + 1)) << "what the CPU wrote counts as newer";
}

}  // namespace
}  // namespace retrograde
