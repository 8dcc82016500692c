// Buffers on the simulated device through HalideRuntime.h: memory, copies, views.
#include <utility>

#include "support/gpu_testing.h"

namespace {

using namespace gpu_testing;

// ---- memory and copies ----

TEST_F(GpuRuntime, CopiesWhereTheDirtyBitsAsk) {
  Buffer<float> b = ramp(100, 10);
  ASSERT_EQ(b.copy_to_device(device()), 0) << errors;
  EXPECT_TRUE(b.has_device_allocation());
  EXPECT_FALSE(b.host_dirty());
  const int64_t copies = retrograde_simt_call_count("cuMemcpyHtoDAsync_v2");
  ASSERT_EQ(b.copy_to_device(device()), 0);
  EXPECT_EQ(retrograde_simt_call_count("cuMemcpyHtoDAsync_v2"), copies);
  spoil_host(b);
  ASSERT_EQ(b.copy_to_host(), 0);
  EXPECT_EQ(at(b, 3, 2), -1.0f) << "the host's copy is not old";
  b.set_device_dirty();
  ASSERT_EQ(b.copy_to_host(), 0);
  EXPECT_EQ(at(b, 3, 2), 2003.0f);
  EXPECT_FALSE(b.device_dirty());
  ASSERT_EQ(b.device_free(), 0);
  EXPECT_FALSE(b.has_device_allocation());
  EXPECT_EQ(b.device_free(), 0);
}

TEST_F(GpuRuntime, RunsKernels) {
  Saxpy saxpy;
  Buffer<float> x = ramp(1000), y = ramp(1000);
  for (int i = 1; i <= 3; i++) ASSERT_EQ(saxpy.run(x, y, 2.0f), 0) << errors;
  ASSERT_EQ(y.device_sync(), 0);
  ASSERT_EQ(y.copy_to_host(), 0);
  expect_saxpy(y, 6.0f);
}

TEST_F(GpuRuntime, EmptyLaunchesAndBuffersAreNothing) {
  Saxpy saxpy;
  Buffer<float> x = ramp(0), y = ramp(0);
  ASSERT_EQ(saxpy.run(x, y, 2.0f), 0) << errors;
  ASSERT_EQ(y.copy_to_host(), 0) << errors;
}

TEST_F(GpuRuntime, CopiesBuffersWithStridesAndHoles) {
  Buffer<int> whole(20, 10, 3);
  whole.for_each_element([&](int x, int y, int c) { whole(x, y, c) = x + 100 * y + 10000 * c; });
  Buffer<int> part = whole.cropped(0, 3, 7).cropped(1, 2, 5);
  part.transpose(0, 2);
  Buffer<int> interleaved = Buffer<int>::make_interleaved(20, 10, 3);
  interleaved.copy_from(whole);
  Buffer<int> flipped(whole);
  halide_buffer_t& raw = *flipped.raw_buffer();
  raw.host += 19 * 4;
  raw.dim[0].stride = -1;
  for (Buffer<int> b : {part, interleaved, flipped}) {
    Buffer<int> expected = b.copy();
    b.set_host_dirty();
    ASSERT_EQ(b.copy_to_device(device()), 0) << errors;
    spoil_host(b);
    b.set_device_dirty();
    ASSERT_EQ(b.copy_to_host(), 0) << errors;
    b.for_each_element([&](const int* at) { ASSERT_EQ(std::as_const(b)(at), expected(at)); });
    ASSERT_EQ(b.device_free(), 0) << errors;
  }
}

TEST_F(GpuRuntime, CropsAndSlicesShareDeviceMemory) {
  Buffer<float> b = ramp(50, 20);
  ASSERT_EQ(b.copy_to_device(device()), 0);
  {
    Buffer<float> crop = b.cropped(0, 10, 5).cropped(1, 4, 6);
    EXPECT_EQ(crop.raw_buffer()->device, b.raw_buffer()->device + (4 * 50 + 10) * 4);
    Buffer<float> slice = b.sliced(1, 7);
    EXPECT_EQ(slice.raw_buffer()->device, b.raw_buffer()->device + 7 * 50 * 4);
    spoil_host(crop);
    crop.set_device_dirty();
    ASSERT_EQ(crop.copy_to_host(), 0) << errors;
    EXPECT_EQ(at(b, 12, 6), 6012.0f);
    spoil_host(slice);
    slice.set_device_dirty();
    ASSERT_EQ(slice.copy_to_host(), 0) << errors;
    EXPECT_EQ(at(b, 49, 7), 7049.0f);
  }
  b.raw_buffer()->dim[0].extent = 40;
  Buffer<float> beyond(45, 20);
  expect_error(halide_device_crop(nullptr, b, beyond), halide_error_code_device_crop_failed,
               {"a view lies inside of its buffer", "[0, 45)"});
  b.raw_buffer()->dim[0].extent = 50;
}

TEST_F(GpuRuntime, WrapsMemoryOfTheProgram) {
  Buffer<float> owner = ramp(64), b(64, 1), c(64, 1);
  ASSERT_EQ(owner.copy_to_device(device()), 0);
  const uint64_t address = owner.raw_buffer()->device;
  ASSERT_EQ(b.device_wrap_native(device(), address), 0) << errors;
  EXPECT_EQ(halide_cuda_get_device_ptr(nullptr, b), address);
  b.set_device_dirty();
  ASSERT_EQ(b.copy_to_host(), 0);
  EXPECT_EQ(at(b, 5, 0), 5.0f);
  expect_error(halide_cuda_wrap_device_ptr(nullptr, b, address),
               halide_error_code_device_wrap_native_failed, {"one device memory at a time"});
  expect_error(halide_cuda_wrap_device_ptr(nullptr, c, 4096),
               halide_error_code_device_wrap_native_failed,
               {"cuPointerGetAttribute gave CUDA_ERROR_INVALID_VALUE", "0x1000"});
  ASSERT_EQ(b.device_detach_native(), 0) << errors;
  EXPECT_FALSE(b.has_device_allocation());
  expect_error(halide_device_detach_native(nullptr, owner),
               halide_error_code_device_detach_native_failed, {"only memory that was wrapped"});
}

TEST_F(GpuRuntime, MemoryThatIsNotOursIsNotFreed) {
  uint64_t address = 0;
  Buffer<float> keeps = ramp(8);  // the context
  ASSERT_EQ(keeps.copy_to_device(device()), 0);
  cuda::Context context = nullptr;
  ASSERT_EQ(halide_cuda_acquire_context(nullptr, &context, true), 0);
  ASSERT_EQ(cuda::cuCtxSetCurrent(context), cuda::success);
  ASSERT_EQ(cuda::cuMemAlloc_v2(&address, 256), cuda::success);
  Buffer<float> b(8, 1);
  ASSERT_EQ(halide_cuda_wrap_device_ptr(nullptr, b, address), 0);
  expect_error(halide_device_free(nullptr, b), halide_error_code_device_free_failed,
               {"nothing that it allocated is at"});
  ASSERT_EQ(halide_cuda_detach_device_ptr(nullptr, b), 0);
  ASSERT_EQ(cuda::cuMemFree_v2(address), cuda::success);
  ASSERT_EQ(cuda::cuCtxSetCurrent(nullptr), cuda::success);
}

TEST_F(GpuRuntime, MemoryOnBothSides) {
  halide_buffer_t b = {};
  halide_dimension_t dims[] = {{0, 16, -1}};
  b.type = halide_type_of<int>();
  b.dimensions = 1;
  b.dim = dims;
  ASSERT_EQ(device()->device_and_host_malloc(nullptr, &b, device()), 0) << errors;
  reinterpret_cast<int*>(b.host)[-15] = 7;
  b.set_host_dirty();
  ASSERT_EQ(halide_copy_to_device(nullptr, &b, nullptr), 0) << errors;
  reinterpret_cast<int*>(b.host)[-15] = 8;
  b.set_device_dirty();
  ASSERT_EQ(halide_copy_to_host(nullptr, &b), 0);
  EXPECT_EQ(reinterpret_cast<int*>(b.host)[-15], 7);
  ASSERT_EQ(device()->device_and_host_free(nullptr, &b), 0);
  EXPECT_EQ(b.host, nullptr);
  EXPECT_EQ(b.device, 0u);
}

// ---- copies between buffers ----

TEST_F(GpuRuntime, CopiesBetweenBuffersOfAnyMemoryAndLayout) {
  Buffer<float> from = ramp(30, 20);
  ASSERT_EQ(from.copy_to_device(device()), 0);
  for (const bool from_device : {false, true}) {
    for (const bool to_device : {false, true}) {
      Buffer<float> to(11, 7);
      to.set_min(4, 9);
      to.transpose(0, 1);
      to.set_min(4, 9);
      Buffer<float> expected = to.copy();
      expected.for_each_element([&](int x, int y) { expected(x, y) = at(from, x, y); });
      from.set_device_dirty(from_device);
      ASSERT_EQ(halide_buffer_copy(nullptr, from, to_device ? device() : nullptr, to), 0) << errors;
      EXPECT_EQ(to.device_dirty(), to_device);
      ASSERT_EQ(to.copy_to_host(), 0);
      to.for_each_element([&](int x, int y) { ASSERT_EQ(at(to, x, y), expected(x, y)); });
      from.set_device_dirty(false);
    }
  }
}

TEST_F(GpuRuntime, CopiesBetweenDevices) {
  options.change([](auto& o) { o.devices = 2; });
  Buffer<float> from = ramp(30, 20), to(10, 10);
  halide_set_gpu_device(0);
  ASSERT_EQ(from.copy_to_device(device()), 0) << errors;
  halide_set_gpu_device(1);
  ASSERT_EQ(to.device_malloc(device()), 0) << errors;
  from.set_device_dirty();
  ASSERT_EQ(halide_buffer_copy(nullptr, from, device(), to), 0) << errors;
  ASSERT_EQ(to.copy_to_host(), 0) << errors;
  EXPECT_EQ(at(to, 9, 9), 9009.0f);
  from.set_device_dirty(false);
}

}  // namespace
