// Errors of the GPU runtime and their messages; threads; the choice of the driver.
#include <atomic>
#include <cstdio>
#include <cstring>
#include <thread>
#include <vector>

#include "support/gpu_testing.h"

namespace {

using namespace gpu_testing;

// ---- errors ----

TEST_F(GpuRuntime, ErrorsOfKernelsSayWhatWasFound) {
  Saxpy saxpy;
  Buffer<float> x = ramp(300), y = ramp(300);
  ASSERT_EQ(saxpy.run(x, y, 1.0f), 0);
  ASSERT_EQ(y.copy_to_host(), 0);
  ASSERT_EQ(saxpy.launch(x, y, 1.0f, 3000), 0) << "it is found when it runs";
  y.set_device_dirty();
  expect_error(y.copy_to_host(), halide_error_code_copy_to_host_failed,
               {"copy a buffer of 1200 bytes to the host", "CUDA_ERROR_ILLEGAL_ADDRESS",
                "kernel saxpy", "\"y(i)\"", "halide_device_release"});
  EXPECT_TRUE(y.device_dirty()) << "it was not copied";
  y.set_device_dirty(false);
  EXPECT_EQ(at(y, 7, 0), 14.0f) << "the host's data are unharmed";
}

TEST_F(GpuRuntime, ALostDeviceComesBackAfterARelease) {
  Saxpy saxpy;
  Buffer<float> x = ramp(300), y = ramp(300);
  ASSERT_EQ(saxpy.run(x, y, 3.0f), 0);
  ASSERT_EQ(y.copy_to_host(), 0);
  retrograde_simt_lose_device(0);
  x.set_host_dirty();
  expect_error(x.copy_to_device(device()), halide_error_code_copy_to_device_failed,
               {"CUDA_ERROR_LAUNCH_FAILED", "the device was lost"});
  expect_saxpy(y, 3.0f);
  EXPECT_EQ(x.device_free(), 0);
  EXPECT_EQ(y.device_free(), 0);
  halide_device_release(nullptr, device());
  errors.clear();
  y = ramp(300);
  ASSERT_EQ(saxpy.run(x, y, 3.0f), 0) << errors;
  ASSERT_EQ(y.copy_to_host(), 0);
  expect_saxpy(y, 3.0f);
}

TEST_F(GpuRuntime, LaunchesAreChecked) {
  Saxpy saxpy;
  Buffer<float> x = ramp(300), y = ramp(300);
  float a = 1;
  int n = 300;
  size_t sizes[] = {8, 8, 4, 4, 0}, wrong_sizes[] = {8, 8, 8, 4, 0};
  void* args[] = {x.raw_buffer(), y.raw_buffer(), &a, &n};
  int8_t is_buffer[] = {1, 1, 0, 0, 0};
  const auto run = [&](const char* name, int threads, int shared, size_t* s) {
    return halide_cuda_run(nullptr, saxpy.state, name, 1, 1, 1, threads, 1, 1, shared, s, args,
                           is_buffer);
  };
  constexpr int failed = halide_error_code_device_run_failed;
  expect_error(run("saxpy", 32, 0, sizes), failed, {"never loaded"});
  ASSERT_EQ(saxpy.load(), 0);
  expect_error(run("saxpy", 32, 0, sizes), failed, {"argument 0 has no device memory"});
  ASSERT_EQ(x.copy_to_device(device()) + y.copy_to_device(device()), 0);
  expect_error(run("sax", 32, 0, sizes), failed,
               {"cuModuleGetFunction gave CUDA_ERROR_NOT_FOUND", "\"sax\""});
  expect_error(run("saxpy", 32, 0, wrong_sizes), failed,
               {"the arguments that it was compiled for"});
  expect_error(run("saxpy", 2000, 0, sizes), failed,
               {"cuLaunchKernel gave CUDA_ERROR_INVALID_VALUE",
                "1 x 1 x 1 blocks of 2000 x 1 x 1 threads", "can have 1024 threads"});
  expect_error(run("saxpy", 32, 300000, sizes), halide_error_code_out_of_memory,
               {"no more shared memory than the device has", "300000 bytes, and there are 232448"});
  expect_error(run("saxpy", -1, 0, sizes), failed, {"no negative extents"});
  EXPECT_EQ(run("saxpy", 32, 200000, sizes), 0) << errors;
}

TEST_F(GpuRuntime, PtxIsNotForTheSimulatedDevice) {
  void* state = nullptr;
  const char* ptx = ".version 7.8\n.target sm_75\n";
  expect_error(halide_cuda_initialize_kernels(nullptr, &state, ptx, 26),
               halide_error_code_device_run_failed,
               {"cuModuleLoadDataEx gave CUDA_ERROR_INVALID_IMAGE", "none of its images"});
  EXPECT_EQ(state, nullptr);
  retrograde_gpu_forget_kernels(ptx);
}

TEST_F(GpuRuntime, BuffersAreChecked) {
  Buffer<float> b = ramp(8), deviceless(nullptr, 8, 1);
  b.raw_buffer()->flags = 3;
  ASSERT_EQ(b.device_malloc(device()), 0);
  expect_error(halide_copy_to_device(nullptr, b, device()), halide_error_code_host_and_device_dirty,
               {"the newest elements are in one place"});
  expect_error(halide_copy_to_host(nullptr, b), halide_error_code_host_and_device_dirty, {});
  b.raw_buffer()->flags = 0;
  expect_error(halide_copy_to_device(nullptr, nullptr, device()), halide_error_code_buffer_is_null,
               {});
  expect_error(halide_device_malloc(nullptr, b, nullptr), halide_error_code_no_device_interface,
               {"halide_cuda_device_interface()"});
  halide_device_interface_t foreign = *device();
  b.raw_buffer()->device_interface = &foreign;
  expect_error(halide_device_free(nullptr, b), halide_error_code_incompatible_device_interface,
               {"another device interface"});
  b.raw_buffer()->device_interface = device();
  const uint64_t address = b.raw_buffer()->device;
  b.raw_buffer()->device = 0;
  expect_error(halide_device_free(nullptr, b), halide_error_code_device_interface_no_device, {});
  b.raw_buffer()->device = address;
  deviceless.raw_buffer()->device = 4711;
  expect_error(halide_device_free(nullptr, deviceless), halide_error_code_no_device_interface, {});
  deviceless.raw_buffer()->device = 0;
  ASSERT_EQ(deviceless.device_malloc(device()), 0);
  deviceless.set_device_dirty();
  expect_error(halide_copy_to_host(nullptr, deviceless), halide_error_code_host_is_null, {});
  deviceless.set_device_dirty(false);
}

TEST_F(GpuRuntime, SaysWhatTheDeviceCanDo) {
  int major = 0, minor = -1;
  ASSERT_EQ(device()->compute_capability(nullptr, &major, &minor), 0);
  EXPECT_EQ(major, 9);
  EXPECT_EQ(minor, 0);
}

// ---- threads ----

TEST_F(GpuRuntime, ThreadsShareKernelsAndBuffers) {
  options.change([](auto& o) { o.devices = 2; });
  Saxpy saxpy;
  Buffer<float> x = ramp(300);
  std::vector<std::thread> threads;
  std::atomic<int> failures{0};
  for (int t = 0; t < 4; t++) {
    threads.emplace_back([&] {
      for (int i = 0; i < 25; i++) {
        Buffer<float> y = ramp(300);
        if (saxpy.run(x, y, 3.0f) != 0 || y.copy_to_host() != 0) failures++;
        for (int k = 0; k < 300; k++) failures += at(y, k, 0) != 4.0f * static_cast<float>(k);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(failures, 0) << errors;
}

void store_one(gpu_kernels::Thread* t, int32_t* data, int32_t) {
  gpu_kernels::store(t, data, 1, 0);
}
void store_two(gpu_kernels::Thread* t, int32_t* data, int32_t) {
  gpu_kernels::store(t, data, 2, 0);
}

TEST_F(GpuRuntime, CodeThatComesToTheSamePlaceIsLoadedAnew) {
  alignas(8) unsigned char place[Image::bytes];
  int factor[2] = {0, 0};
  for (const bool second : {false, true}) {
    const Image first_image{gpu_kernels::array_kernel<store_one>("kernel", false)};
    const Image second_image{gpu_kernels::array_kernel<store_two>("kernel", false)};
    std::memcpy(place, (second ? second_image : first_image).source(), sizeof place);
    void* state = nullptr;
    const char* source = reinterpret_cast<const char*>(place);
    ASSERT_EQ(halide_cuda_initialize_kernels(nullptr, &state, source, Image::bytes), 0) << errors;
    Buffer<int> b(1);
    ASSERT_EQ(b.device_malloc(device()), 0);
    size_t sizes[] = {8, 4, 0};
    int n = 1;
    void* args[] = {b.raw_buffer(), &n};
    int8_t is_buffer[] = {1, 0, 0};
    ASSERT_EQ(
        halide_cuda_run(nullptr, state, "kernel", 1, 1, 1, 1, 1, 1, 0, sizes, args, is_buffer), 0)
        << errors;
    b.set_device_dirty();
    ASSERT_EQ(b.copy_to_host(), 0) << errors;
    factor[second] = b(0);
  }
  EXPECT_EQ(factor[0], 1);
  EXPECT_EQ(factor[1], 2);
  retrograde_gpu_forget_kernels(place);
}

// ---- choice of the driver ----

TEST_F(GpuRuntime, TheDriverIsChosenNotGuessed) {
  // Runs in separate processes, because the driver is opened once.
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(
      {
        setenv("RETROGRADE_GPU", "maybe", 1);
        halide_set_error_handler([](void*, const char* text) { std::fputs(text, stderr); });
        Buffer<float> b(4, 1);
        std::exit(b.device_malloc(device()) == halide_error_code_device_malloc_failed ? 0 : 1);
      },
      testing::ExitedWithCode(0), "must be .cuda. or .simulated.; it is .maybe.");
  EXPECT_EXIT(
      {
        unsetenv("RETROGRADE_GPU");
        halide_set_custom_load_library([](const char*) -> void* { return nullptr; });
        halide_set_error_handler([](void*, const char* text) { std::fputs(text, stderr); });
        Buffer<float> b(4, 1);
        std::exit(b.device_malloc(device()) == halide_error_code_device_malloc_failed ? 0 : 1);
      },
      testing::ExitedWithCode(0), "libcuda.so.1 was not found.*RETROGRADE_GPU=simulated");
}

}  // namespace
