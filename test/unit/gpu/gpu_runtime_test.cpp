// The GPU runtime over the simulated driver: devices, streams, the memory pool, capture.
#include "support/gpu_testing.h"

namespace {

using namespace gpu_testing;

// ---- devices, contexts, streams ----

TEST_F(GpuRuntime, SeveralDevicesHaveTheirOwnMemoryAndKernels) {
  options.change([](auto& o) { o.devices = 3; });
  Saxpy saxpy;
  for (const int number : {0, 2, 1, -1}) {
    halide_set_gpu_device(number);
    Buffer<float> x = ramp(300), y = ramp(300);
    ASSERT_EQ(saxpy.run(x, y, 3.0f), 0) << errors;
    halide_set_gpu_device(0);
    ASSERT_EQ(y.copy_to_host(), 0) << errors;
    expect_saxpy(y, 3.0f);
  }
  EXPECT_EQ(live_objects().modules, 3);
  EXPECT_EQ(live_objects().contexts, 3);
  halide_set_gpu_device(7);
  Buffer<float> b(4, 1);
  expect_error(b.device_malloc(device()), halide_error_code_device_malloc_failed,
               {"number 7 was asked for, and there are 3", "HL_GPU_DEVICE"});
}

TEST_F(GpuRuntime, ABufferOfAnotherDeviceIsAnError) {
  options.change([](auto& o) { o.devices = 2; });
  Saxpy saxpy;
  Buffer<float> x = ramp(300), y = ramp(300);
  halide_set_gpu_device(0);
  ASSERT_EQ(x.copy_to_device(device()), 0);
  halide_set_gpu_device(1);
  expect_error(saxpy.run(x, y, 3.0f), halide_error_code_device_run_failed,
               {"run the kernel \"saxpy\"", "on another device"});
}

TEST_F(GpuRuntime, WorksInTheContextAndOnTheStreamThatItIsGiven) {
  const GivenStream given;
  ASSERT_EQ(cuda::cuCtxSetCurrent(nullptr), cuda::success);
  Saxpy saxpy;
  {
    Buffer<float> x = ramp(300), y = ramp(300);
    ASSERT_EQ(saxpy.run(x, y, 3.0f), 0) << errors;
    EXPECT_EQ(live_objects().contexts, 1) << "no other was made";
    expect_work_on(user_context_made, user_stream);
    ASSERT_EQ(y.copy_to_host(), 0);
    expect_saxpy(y, 3.0f);
  }
}

TEST_F(GpuRuntime, HandlersThatFailAreErrors) {
  halide_set_cuda_acquire_context([](void*, void**, bool) { return -77; });
  Buffer<float> b(4, 1);
  expect_error(b.device_malloc(device()), halide_error_code_device_malloc_failed,
               {"acquire_context gave -77"});
  halide_set_cuda_acquire_context(nullptr);
  halide_set_cuda_get_stream([](void*, void*, void**) { return -78; });
  expect_error(b.device_malloc(device()), halide_error_code_device_malloc_failed,
               {"get_stream gave -78"});
}

TEST_F(GpuRuntime, CopiesToTheHostWaitForTheStreamThatWrote) {
  const GivenStream given;
  Saxpy saxpy;
  for (int i = 0; i < 10; i++) {
    Buffer<float> x = ramp(300), y = ramp(300);
    ASSERT_EQ(saxpy.run(x, y, 3.0f), 0) << errors;
    const OnDefaultStream reading;
    ASSERT_EQ(y.copy_to_host(), 0) << errors;
    expect_saxpy(y, 3.0f);
  }
}

// ---- the pool ----

TEST_F(GpuRuntime, FreedMemoryIsUsedAgain) {
  Saxpy saxpy;
  int64_t allocations = 0;
  for (int i = 0; i < 5; i++) {
    Buffer<float> x = ramp(1000 + i), y = ramp(1000 + i);
    ASSERT_EQ(saxpy.run(x, y, 1.0f), 0);
    ASSERT_EQ(y.copy_to_host(), 0);
    if (i == 0) allocations = retrograde_simt_call_count("cuMemAlloc_v2");
  }
  EXPECT_EQ(retrograde_simt_call_count("cuMemAlloc_v2"), allocations);
  EXPECT_EQ(live_objects().allocations, 2);
  ASSERT_EQ(halide_cuda_release_unused_device_allocations(nullptr), 0);
  EXPECT_EQ(live_objects().allocations, 0);
}

TEST_F(GpuRuntime, WithoutReuseMemoryGoesBackAtOnce) {
  ASSERT_EQ(halide_reuse_device_allocations(nullptr, false), 0);
  EXPECT_FALSE(halide_can_reuse_device_allocations(nullptr));
  Buffer<float> b = ramp(1000);
  ASSERT_EQ(b.copy_to_device(device()), 0);
  EXPECT_EQ(live_objects().allocations, 1);
  ASSERT_EQ(b.device_free(), 0);
  EXPECT_EQ(live_objects().allocations, 0);
}

TEST_F(GpuRuntime, UnusedMemoryMakesRoom) {
  options.change([](auto& o) { o.memory_bytes = 1 << 20; });
  {
    Buffer<uint8_t> b(700000);
    ASSERT_EQ(b.device_malloc(device()), 0) << errors;
  }
  Buffer<uint8_t> c(900000), d(300000);
  ASSERT_EQ(c.device_malloc(device()), 0) << errors;
  expect_error(d.device_malloc(device()), halide_error_code_device_malloc_failed,
               {"allocate device memory for a buffer of 300000 bytes", "cuMemAlloc_v2 gave",
                "CUDA_ERROR_OUT_OF_MEMORY", "out of memory", "has 1048576", "smaller tiles"});
  EXPECT_FALSE(d.has_device_allocation());
}

TEST_F(GpuRuntime, MemoryThatAStreamUsesIsNotGivenToAnother) {
  const GivenStream given;
  Saxpy saxpy;
  for (int i = 0; i < 20; i++) {
    Buffer<float> x = ramp(5000), y = ramp(5000);
    ASSERT_EQ(saxpy.run(x, y, 1.0f), 0) << errors;
    x.set_host_dirty(false);
    ASSERT_EQ(x.device_free(), 0);
    Buffer<float> other(5000, 1);
    other.fill(-1.0f);
    other.set_host_dirty();
    {
      const OnDefaultStream writing;
      ASSERT_EQ(other.copy_to_device(device()), 0) << errors;
    }
    ASSERT_EQ(y.copy_to_host(), 0);
    expect_saxpy(y, 1.0f);
  }
}

int64_t allocated = 0;
void* allocate_ours(void*, size_t bytes, void*) {
  if (bytes > 100000) return nullptr;
  cuda::Address address = 0;
  EXPECT_EQ(cuda::cuMemAlloc_v2(&address, bytes), cuda::success);
  allocated++;
  return reinterpret_cast<void*>(address);
}
int32_t release_ours(void*, void* address, size_t, void*) {
  allocated--;
  return cuda::cuMemFree_v2(reinterpret_cast<cuda::Address>(address));
}

TEST_F(GpuRuntime, MemoryOfTheProgramsAllocator) {
  const GivenStream given;  // whose context is current
  retrograde_set_device_allocator(allocate_ours, release_ours);
  Saxpy saxpy;
  {
    Buffer<float> x = ramp(300), y = ramp(300), large(100000, 1);
    ASSERT_EQ(saxpy.run(x, y, 3.0f), 0) << errors;
    EXPECT_EQ(allocated, 2);
    expect_error(large.device_malloc(device()), halide_error_code_device_malloc_failed,
                 {"the caller's allocator must have memory", "400000 bytes"});
    ASSERT_EQ(y.copy_to_host(), 0);
    expect_saxpy(y, 3.0f);
  }
  EXPECT_EQ(allocated, 0);
}

// ---- capture ----

TEST_F(GpuRuntime, ARunIsCapturedOnceItHasRun) {
  const GivenStream given;
  Saxpy saxpy;
  Buffer<float> x = ramp(300), y = ramp(300);
  const auto run_with_temporary = [&] {
    // An intermediate of the pipeline: t = 2 x + t, y = 3 t + y.
    Buffer<float> t(nullptr, 300, 1);
    int code = halide_device_malloc(nullptr, t, device());
    if (code == 0) code = halide_buffer_copy(nullptr, x, device(), t);
    if (code == 0) code = saxpy.launch(x, t, 2.0f, 300);
    if (code == 0) code = saxpy.launch(t, y, 3.0f, 300);
    t.set_device_dirty(false);
    const int freed = halide_device_free(nullptr, t);
    return code ? code : freed;
  };
  ASSERT_EQ(saxpy.run(x, y, 0.0f), 0) << errors;
  x.set_device_dirty();  // the run must read the device's elements
  ASSERT_EQ(run_with_temporary(), 0) << errors;
  CapturedGraph graph;
  graph.begin();
  EXPECT_EQ(run_with_temporary(), 0) << errors;
  graph.end();
  // The graph's memory is exclusive: other buffers of this size do not disturb it.
  Buffer<float> others[3];
  for (Buffer<float>& other : others) {
    other = Buffer<float>(300, 1);
    other.fill(-5.0f);
    other.set_host_dirty();
    ASSERT_EQ(other.copy_to_device(device()), 0) << errors;
  }
  graph.launch(4);
  y.set_device_dirty();
  ASSERT_EQ(y.copy_to_host(), 0) << errors;
  for (int i = 0; i < 300; i++) ASSERT_EQ(at(y, i, 0), static_cast<float>(i) * (1 + 5 * 9)) << i;
  for (Buffer<float>& other : others) {
    other.set_device_dirty();
    ASSERT_EQ(other.copy_to_host(), 0);
    EXPECT_TRUE(other.all_equal(-5.0f));
  }
}

// As PyTorch captures: on another stream than the one that ran before.
TEST_F(GpuRuntime, MemoryThatACaptureLacksIsAllocatedForItsGraph) {
  const GivenStream given;
  Saxpy saxpy;
  Buffer<float> x = ramp(300), y = ramp(300);
  ASSERT_EQ(saxpy.run(x, y, 0.0f), 0) << errors;
  x.set_device_dirty();
  CapturedGraph graph;
  Buffer<float> t(nullptr, 300, 1), other(300, 1);
  graph.begin();
  EXPECT_EQ(halide_device_malloc(nullptr, t, device()), 0) << errors;
  EXPECT_EQ(halide_buffer_copy(nullptr, x, device(), t), 0) << errors;
  EXPECT_EQ(saxpy.launch(t, y, 2.0f, 300), 0) << errors;
  t.set_device_dirty(false);
  EXPECT_EQ(halide_device_free(nullptr, t), 0) << errors;
  int mode = cuda::capture_mode_global;
  EXPECT_EQ(cuda::cuThreadExchangeStreamCaptureMode(&mode), cuda::success);
  EXPECT_EQ(mode, cuda::capture_mode_global) << "the thread's mode is as it was";
  graph.end();
  other.fill(-5.0f);
  other.set_host_dirty();
  ASSERT_EQ(other.copy_to_device(device()), 0) << errors;  // gets other memory than the graph's
  graph.launch(3);
  y.set_device_dirty();
  ASSERT_EQ(y.copy_to_host(), 0) << errors;
  for (int i = 0; i < 300; i++) ASSERT_EQ(at(y, i, 0), static_cast<float>(i) * (1 + 3 * 2)) << i;
  other.set_device_dirty();
  ASSERT_EQ(other.copy_to_host(), 0) << errors;
  EXPECT_TRUE(other.all_equal(-5.0f));
}

TEST_F(GpuRuntime, WhatACaptureCannotHoldIsAnErrorThatSaysSo) {
  const GivenStream given;
  Saxpy saxpy;
  Buffer<float> x = ramp(300), y = ramp(300);
  cuda::Graph graph = nullptr;
  ASSERT_EQ(x.copy_to_device(device()), 0);
  ASSERT_EQ(cuda::cuStreamBeginCapture_v2(user_stream, 0), cuda::success);
  expect_error(saxpy.load(), halide_error_code_device_run_failed,
               {"nothing is loaded while a graph is captured", "once before the capture"});
  x.set_host_dirty();
  expect_error(x.copy_to_device(device()), halide_error_code_copy_to_device_failed,
               {"nothing is copied from or to the host while a graph is captured"});
  x.set_host_dirty(false);
  x.set_device_dirty();
  expect_error(x.copy_to_host(), halide_error_code_copy_to_host_failed,
               {"nothing is copied from or to the host while a graph is captured"});
  EXPECT_EQ(cuda::cuStreamEndCapture(user_stream, &graph), cuda::success)
      << "the capture goes on: nothing reached the driver";
  EXPECT_EQ(cuda::cuGraphDestroy(graph), cuda::success);
  ASSERT_EQ(x.copy_to_host(), 0);
}

}  // namespace
