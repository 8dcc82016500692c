// Calls functions with kernels that a generator compiled ahead of time, from a program written only
// for Halide's headers. It links their objects and the static runtime, but not the compiler.
#include <HalideBuffer.h>
#include <HalideRuntimeCuda.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

#include "gpu_filter.h"
#include "gpu_filter_devices_only.h"
#include "space_gpu_filter.h"
#include "support/gpu_filter_testing.h"
#include "support/simulated_fixture.h"

namespace {

using namespace gpu_filter_testing;

class AotGpu : public SimulatedDevice {};

TEST_F(AotGpu, KernelsAndTheHostTakeTurns) {
  Buffer<float, 2> in = input(100, 60), out(100, 60);
  for (int order = retrograde_simt_forward; order <= retrograde_simt_warp_ahead; order++) {
    options.change([&](auto& o) { o.order = order; });
    ASSERT_EQ(gpu_filter(in, 2.0f, out), 0) << errors;
    EXPECT_TRUE(out.device_dirty()) << "results stay on the device";
    ASSERT_EQ(out.copy_to_host(), 0) << errors;
    expect_filtered(in, 2.0f, out);
  }
}

TEST_F(AotGpu, ResultsOnTheDeviceAreInputsWithoutACopy) {
  Buffer<float, 2> in = input(64, 32), between(64, 32), out(64, 32);
  ASSERT_EQ(gpu_filter(in, 1.0f, between), 0) << errors;
  ASSERT_EQ(gpu_filter(in, 1.0f, out), 0) << errors;
  const int64_t copies = retrograde_simt_call_count("cuMemcpyHtoDAsync_v2");
  ASSERT_EQ(gpu_filter(in, 1.0f, out), 0) << errors;
  // Only the host's column sums are copied.
  EXPECT_EQ(retrograde_simt_call_count("cuMemcpyHtoDAsync_v2"), copies + 1)
      << "what is there is not copied again";
  ASSERT_EQ(gpu_filter(between, 1.0f, out), 0) << errors;
  EXPECT_EQ(retrograde_simt_call_count("cuMemcpyHtoDAsync_v2"), copies + 2);
  ASSERT_EQ(between.copy_to_host(), 0);
  ASSERT_EQ(out.copy_to_host(), 0);
  expect_filtered(between, 1.0f, out);
}

TEST_F(AotGpu, FunctionsOfOneNameInTwoNamespacesHaveTheirOwnKernels) {
  Buffer<float, 2> in = input(40, 20), out(40, 20);
  ASSERT_EQ(gpu_filter(in, 1.0f, out), 0) << errors;
  ASSERT_EQ(space::gpu_filter(in, 3.0f, out), 0) << errors;
  EXPECT_EQ(live_objects().modules, 2);
  ASSERT_EQ(out.copy_to_host(), 0);
  expect_filtered(in, 3.0f, out);
}

TEST_F(AotGpu, ArgumentsAsAnArray) {
  Buffer<float, 2> in = input(40, 20), out(40, 20);
  float gain = 4;
  void* args[] = {in.raw_buffer(), &gain, out.raw_buffer()};
  ASSERT_EQ(gpu_filter_argv(args), 0) << errors;
  ASSERT_EQ(out.copy_to_host(), 0);
  expect_filtered(in, gain, out);
  EXPECT_NE(std::string(gpu_filter_metadata()->target).find("-cuda-"), std::string::npos);
}

// ---- Halide's device functions ----

TEST_F(AotGpu, MemoryIsKeptForTheNextCallUnlessThatIsForbidden) {
  const auto run = [] {
    Buffer<float, 2> in = input(64, 32), out(64, 32);
    EXPECT_EQ(gpu_filter(in, 1.0f, out), 0) << errors;
    EXPECT_EQ(halide_device_sync(nullptr, out), 0);
  };
  run();
  EXPECT_GT(live_objects().allocations, 0);
  const int64_t calls = retrograde_simt_call_count("cuMemAlloc_v2");
  run();
  EXPECT_EQ(retrograde_simt_call_count("cuMemAlloc_v2"), calls);
  EXPECT_EQ(halide_cuda_release_unused_device_allocations(nullptr), 0);
  EXPECT_EQ(live_objects().allocations, 0);
  EXPECT_EQ(halide_reuse_device_allocations(nullptr, false), 0);
  EXPECT_FALSE(halide_can_reuse_device_allocations(nullptr));
  run();
  EXPECT_EQ(live_objects().allocations, 0);
}

TEST_F(AotGpu, AReleasedDeviceIsThereForTheNextCall) {
  for (int i = 0; i < 2; i++) {
    Buffer<float, 2> in = input(64, 32), out(64, 32);
    ASSERT_EQ(gpu_filter(in, 1.0f, out), 0) << errors;
    ASSERT_EQ(out.copy_to_host(), 0);
    expect_filtered(in, 1.0f, out);
    in.device_free();
    out.device_free();
    halide_device_release(nullptr, device());
    EXPECT_EQ(live_objects().modules, 0);
  }
}

TEST_F(AotGpu, MemoryOfTheProgramIsWrapped) {
  Buffer<float, 2> in = input(64, 32), out(64, 32);
  ASSERT_EQ(in.device_malloc(device()), 0);
  ASSERT_EQ(out.device_malloc(device()), 0);
  const auto address = halide_cuda_get_device_ptr(nullptr, out);
  Buffer<float, 2> same(nullptr, 64, 32);
  ASSERT_EQ(halide_cuda_wrap_device_ptr(nullptr, same, address), 0) << errors;
  ASSERT_EQ(gpu_filter(in, 1.0f, same), 0) << errors;
  same.set_device_dirty(false);
  ASSERT_EQ(halide_cuda_detach_device_ptr(nullptr, same), 0) << errors;
  out.set_device_dirty();
  ASSERT_EQ(out.copy_to_host(), 0) << errors;
  expect_filtered(in, 1.0f, out);
}

// Every device function declared in HalideRuntime.h and HalideRuntimeCuda.h exists under its name.
TEST_F(AotGpu, EveryFunctionOfDevicesHasItsName) {
  const void* const functions[] = {
      reinterpret_cast<void*>(halide_cuda_device_interface),
      reinterpret_cast<void*>(halide_cuda_initialize_kernels),
      reinterpret_cast<void*>(halide_cuda_run),
      reinterpret_cast<void*>(halide_cuda_finalize_kernels),
      reinterpret_cast<void*>(halide_cuda_wrap_device_ptr),
      reinterpret_cast<void*>(halide_cuda_detach_device_ptr),
      reinterpret_cast<void*>(halide_cuda_get_device_ptr),
      reinterpret_cast<void*>(halide_cuda_release_unused_device_allocations),
      reinterpret_cast<void*>(halide_set_cuda_acquire_context),
      reinterpret_cast<void*>(halide_set_cuda_release_context),
      reinterpret_cast<void*>(halide_set_cuda_get_stream),
      reinterpret_cast<void*>(halide_device_release),
      reinterpret_cast<void*>(halide_copy_to_host),
      reinterpret_cast<void*>(halide_copy_to_device),
      reinterpret_cast<void*>(halide_buffer_copy),
      reinterpret_cast<void*>(halide_device_crop),
      reinterpret_cast<void*>(halide_device_slice),
      reinterpret_cast<void*>(halide_device_release_crop),
      reinterpret_cast<void*>(halide_device_sync),
      reinterpret_cast<void*>(halide_device_malloc),
      reinterpret_cast<void*>(halide_device_free),
      reinterpret_cast<void*>(halide_device_wrap_native),
      reinterpret_cast<void*>(halide_device_detach_native),
      reinterpret_cast<void*>(halide_set_gpu_device),
      reinterpret_cast<void*>(halide_get_gpu_device),
      reinterpret_cast<void*>(halide_reuse_device_allocations),
      reinterpret_cast<void*>(halide_can_reuse_device_allocations),
      reinterpret_cast<void*>(halide_register_device_allocation_pool)};
  for (const void* function : functions) EXPECT_NE(function, nullptr);
}

// ---- errors ----

TEST_F(AotGpu, FailuresAreErrorCodesWithReasons) {
  Buffer<float, 2> in = input(64, 32), out(64, 32);
  ASSERT_EQ(gpu_filter(in, 1.0f, out), 0) << errors;
  retrograde_simt_fail_call("cuLaunchKernel", 1, 1);
  EXPECT_EQ(gpu_filter(in, 1.0f, out), halide_error_code_device_run_failed);
  EXPECT_NE(errors.find("run the kernel \"kernel_gpu_filter_pipeline_0\""), std::string::npos)
      << errors;
  ASSERT_EQ(gpu_filter(in, 1.0f, out), 0) << errors;
  ASSERT_EQ(out.copy_to_host(), 0);
  expect_filtered(in, 1.0f, out);
}

TEST_F(AotGpu, KernelsForDevicesAloneSayWhatTheSimulatedOneWants) {
  Buffer<float, 2> in = input(64, 32), out(64, 32);
  EXPECT_EQ(gpu_filter_devices_only(in, 1.0f, out), halide_error_code_device_run_failed);
  EXPECT_NE(errors.find("these were compiled for devices alone"), std::string::npos) << errors;
  EXPECT_NE(errors.find("RETROGRADE_GPU=simulated"), std::string::npos) << errors;
}

}  // namespace
