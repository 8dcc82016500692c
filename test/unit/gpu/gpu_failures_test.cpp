// Lets each call of each driver function fail once, in a program that uses them all. Each failure
// must give an error code, leak nothing, and leave the next run correct.
#include <HalideBuffer.h>
#include <HalideRuntimeCuda.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <map>
#include <set>
#include <string>

#include "gpu/gpu_calls.h"
#include "support/gpu_kernels.h"
#include "support/simulated_driver.h"

namespace {

namespace cuda = retrograde::cuda;
using gpu_kernels::Image;
using Halide::Runtime::Buffer;

std::string errors;
const halide_device_interface_t* device() { return halide_cuda_device_interface(); }

// Frees device memory on every path, as generated code does.
struct OnDevice {
  halide_buffer_t* buffer;
  int& code;
  ~OnDevice() {
    buffer->set_device_dirty(false);
    const int freed = halide_device_free(nullptr, buffer);
    if (code == 0) code = freed;
  }
};

// ---- the program ----

struct Program {
  Image image{gpu_kernels::saxpy_kernel(), gpu_kernels::transpose_kernel()};
  void* state = nullptr;
  Buffer<float> x{64, 64}, y{64, 64}, out{64, 64}, part{16, 16};
  cuda::Stream stream = nullptr;

  Program() {
    x.for_each_element([&](int a, int b) { x(a, b) = static_cast<float>(a * 3 + b); });
  }
  ~Program() { retrograde_gpu_forget_kernels(image.source()); }

  int saxpy() {
    float a = 2;
    int n = 64 * 64;
    size_t sizes[] = {8, 8, 4, 4, 0};
    void* args[] = {x.raw_buffer(), y.raw_buffer(), &a, &n};
    int8_t is_buffer[] = {1, 1, 0, 0, 0};
    return halide_cuda_run(nullptr, state, "saxpy", 32, 1, 1, 128, 1, 1, 0, sizes, args, is_buffer);
  }
  int transpose(halide_buffer_t* to) {
    int n = 64;
    size_t sizes[] = {8, 8, 4, 0};
    void* args[] = {y.raw_buffer(), to, &n};
    int8_t is_buffer[] = {1, 1, 0, 0};
    return halide_cuda_run(nullptr, state, "transpose", 2, 2, 1, 32, 8, 1, 60000, sizes, args,
                           is_buffer);
  }

  // out = transposed(2 x + y), part = its corner; through a temporary image.
  int run() {
    int code = halide_cuda_initialize_kernels(nullptr, &state, image.source(), Image::bytes);
    if (code) return code;
    y.fill(1.0f);
    x.set_host_dirty();
    y.set_host_dirty();
    run_on_device(code);
    return code;
  }
  void run_on_device(int& code) {
    Buffer<float> temporary(nullptr, 64, 64);
    const OnDevice first{x, code}, second{y, code}, third{temporary, code}, fourth{out, code},
        fifth{part, code};
    const auto step = [&](auto f) {
      if (code == 0) code = f();
    };
    step([&] { return halide_copy_to_device(nullptr, x, device()); });
    step([&] { return halide_copy_to_device(nullptr, y, device()); });
    step([&] { return saxpy(); });
    step([&] { return halide_device_malloc(nullptr, temporary, device()); });
    step([&] { return transpose(temporary); });
    temporary.set_device_dirty();
    step([&] { return halide_buffer_copy(nullptr, temporary, device(), out); });
    step([&] { return halide_buffer_copy(nullptr, temporary, device(), part); });
    step([&] { return halide_device_sync(nullptr, out); });
    step([&] { return halide_copy_to_host(nullptr, out); });
    step([&] { return halide_copy_to_host(nullptr, part); });
    out.set_device_dirty(false);
    part.set_device_dirty(false);
  }

  bool is_right() {
    bool right = true;
    out.for_each_element([&](int a, int b) {
      right = right && out(a, b) == 2 * x(b, a) + 1;
      if (a < 16 && b < 16) right = right && part(a, b) == out(a, b);
    });
    return right;
  }
};

class GpuFailures : public testing::Test {
 protected:
  GpuFailures() {
    setenv("RETROGRADE_GPU", "simulated", 1);
    halide_set_error_handler([](void*, const char* text) { errors += text; });
    halide_set_gpu_device(0);
  }
  ~GpuFailures() override {
    halide_reuse_device_allocations(nullptr, true);
    halide_device_release(nullptr, device());
    halide_set_error_handler(nullptr);
  }
};

std::vector<std::string> driver_functions() {
  std::vector<std::string> names;
  for (int i = 0; retrograde_simt_function(i); i++) names.emplace_back(retrograde_simt_function(i));
  return names;
}

// How often a program calls each function, from start to clean-up.
template <typename Run>
std::map<std::string, int64_t> calls_of(Run run) {
  std::map<std::string, int64_t> calls;
  for (const std::string& name : driver_functions())
    calls[name] = -retrograde_simt_call_count(name.c_str());
  run();
  for (auto& [name, count] : calls) count += retrograde_simt_call_count(name.c_str());
  return calls;
}

// Functions that describe errors: their own failure is not an error.
const std::set<std::string> only_text = {"cuGetErrorName", "cuGetErrorString"};

void expect_nothing_left() {
  halide_device_release(nullptr, device());
  const retrograde_simt_live live = live_objects();
  EXPECT_EQ(live.allocations, 0);
  EXPECT_EQ(live.modules, 0);
  EXPECT_EQ(live.contexts, 0);
  EXPECT_EQ(live.pending, 0);
}

// Makes the nth call of the function return `result`.
void fail_once(Program& program, const std::string& function, int64_t nth, int result) {
  SCOPED_TRACE(function + " " + std::to_string(nth) + " gives " + std::to_string(result));
  errors.clear();
  retrograde_simt_fail_call(function.c_str(), nth, result);
  const int code = program.run();
  const int left = retrograde_simt_call_off();
  EXPECT_EQ(left, 0) << "the call never came";
  EXPECT_LT(code, 0);
  EXPECT_NE(errors.find(function), std::string::npos) << errors;
  EXPECT_NE(errors.find("cannot "), std::string::npos) << errors;
  errors.clear();
  program.out.fill(0.0f);
  EXPECT_EQ(program.run(), 0) << errors;
  EXPECT_TRUE(program.is_right()) << "after a failure";
}

void fail_each_call(Program& program, int result) {
  ASSERT_EQ(program.run(), 0) << errors;
  expect_nothing_left();
  const auto calls = calls_of([&] {
    ASSERT_EQ(program.run(), 0) << errors;
    ASSERT_TRUE(program.is_right());
  });
  expect_nothing_left();
  for (const auto& [function, count] : calls) {
    if (only_text.count(function)) continue;
    for (int64_t nth = 1; nth <= count; nth++) {
      fail_once(program, function, nth, result);
      expect_nothing_left();
      if (testing::Test::HasFailure()) return;
    }
  }
}

// Must be the first test in this file: the driver is opened once.
TEST_F(GpuFailures, TheDriverIsInitializedAgainAfterAFailure) {
  errors.clear();
  Buffer<float> b(8, 8);
  retrograde_simt_fail_call("cuInit", 1, cuda::not_initialized);
  EXPECT_EQ(b.device_malloc(device()), halide_error_code_device_malloc_failed);
  EXPECT_NE(errors.find("cuInit gave CUDA_ERROR_NOT_INITIALIZED"), std::string::npos) << errors;
  EXPECT_EQ(b.device_malloc(device()), 0) << errors;
}

TEST_F(GpuFailures, EachDriverCallFailsOnce) {
  Program program;
  fail_each_call(program, cuda::unknown_error);
}

TEST_F(GpuFailures, EachDriverCallFailsOnceWithoutReuse) {
  halide_reuse_device_allocations(nullptr, false);
  Program program;
  fail_each_call(program, cuda::unknown_error);
}

TEST_F(GpuFailures, TheProgramUsesMostOfTheDriver) {
  Program program;
  program.run();
  expect_nothing_left();
  std::set<std::string> unused;
  const auto calls = calls_of([&] {
    program.run();
    expect_nothing_left();
  });
  for (const auto& [function, count] : calls) {
    if (count == 0) unused.insert(function);
  }
  EXPECT_EQ(unused, (std::set<std::string>{
                        "cuCtxGetDevice", "cuCtxSynchronize", "cuDeviceGetAttribute",
                        "cuDriverGetVersion", "cuFuncGetAttribute", "cuGetErrorName",
                        "cuGetErrorString", "cuInit", "cuMemcpyPeerAsync", "cuPointerGetAttribute",
                        "cuStreamGetCaptureInfo_v2", "cuThreadExchangeStreamCaptureMode"}))
      << "what is listed here fails in tests of its own";
}

// ---- functions that this program does not use ----

void expect_failure(const char* function, int code, int expected) {
  EXPECT_EQ(code, expected) << errors;
  EXPECT_EQ(retrograde_simt_call_off(), 0) << function << " was never called";
  EXPECT_NE(errors.find(function), std::string::npos) << errors;
  errors.clear();
}

TEST_F(GpuFailures, FunctionsForGivenStreams) {
  static cuda::Stream stream = nullptr;
  static cuda::Context context = nullptr;
  ASSERT_EQ(cuda::cuInit(0), cuda::success);
  ASSERT_EQ(cuda::cuCtxCreate_v2(&context, 0, 0), cuda::success);
  ASSERT_EQ(cuda::cuStreamCreate(&stream, 0), cuda::success);
  halide_set_cuda_get_stream([](void*, void*, void** out) {
    *out = stream;
    return 0;
  });
  halide_set_cuda_acquire_context([](void*, void** out, bool) {
    *out = context;
    return 0;
  });
  errors.clear();
  {
    Buffer<float> a(8, 8), b(8, 8), other(8, 8);
    retrograde_simt_fail_call("cuCtxGetDevice", 1, cuda::unknown_error);
    expect_failure("cuCtxGetDevice", a.device_malloc(device()),
                   halide_error_code_device_malloc_failed);
    retrograde_simt_fail_call("cuStreamGetCaptureInfo_v2", 1, cuda::unknown_error);
    expect_failure("cuStreamGetCaptureInfo_v2", a.device_malloc(device()),
                   halide_error_code_device_malloc_failed);
    cuda::Graph graph = nullptr;
    ASSERT_EQ(cuda::cuStreamBeginCapture_v2(stream, 0), cuda::success);
    retrograde_simt_fail_call("cuThreadExchangeStreamCaptureMode", 1, cuda::unknown_error);
    expect_failure("cuThreadExchangeStreamCaptureMode", a.device_malloc(device()),
                   halide_error_code_device_malloc_failed);
    ASSERT_EQ(cuda::cuStreamEndCapture(stream, &graph), cuda::success);
    ASSERT_EQ(cuda::cuGraphDestroy(graph), cuda::success);
    a.fill(3.0f);
    a.set_host_dirty();
    ASSERT_EQ(a.copy_to_device(device()), 0) << errors;
    a.set_device_dirty();
    retrograde_simt_fail_call("cuMemcpyDtoDAsync_v2", 1, cuda::unknown_error);
    expect_failure("cuMemcpyDtoDAsync_v2", halide_buffer_copy(nullptr, a, device(), b),
                   halide_error_code_device_buffer_copy_failed);
    ASSERT_EQ(halide_buffer_copy(nullptr, a, device(), b), 0) << errors;
    // Another stream uses the stream's memory, so it must wait.
    ASSERT_EQ(a.copy_to_host(), 0);
    ASSERT_EQ(a.device_free(), 0);
    halide_set_cuda_get_stream(nullptr);
    retrograde_simt_fail_call("cuCtxSynchronize", 1, cuda::unknown_error);
    expect_failure("cuCtxSynchronize", other.device_malloc(device()),
                   halide_error_code_device_malloc_failed);
    ASSERT_EQ(other.device_malloc(device()), 0) << errors;
    ASSERT_EQ(b.copy_to_host(), 0) << errors;
    EXPECT_TRUE(b.all_equal(3.0f));
  }
  halide_device_release(nullptr, device());
  halide_set_cuda_acquire_context(nullptr);
  ASSERT_EQ(cuda::cuCtxDestroy_v2(context), cuda::success);
  expect_nothing_left();
}

TEST_F(GpuFailures, FunctionsForSeveralDevices) {
  SimulatedOptions options;
  options.change([](auto& o) { o.devices = 2; });
  {
    Buffer<float> a(8, 8), b(8, 8);
    a.fill(3.0f);
    a.set_host_dirty();
    ASSERT_EQ(a.copy_to_device(device()), 0) << errors;
    halide_set_gpu_device(1);
    ASSERT_EQ(b.device_malloc(device()), 0);
    a.set_device_dirty();
    retrograde_simt_fail_call("cuMemcpyPeerAsync", 1, cuda::unknown_error);
    expect_failure("cuMemcpyPeerAsync", halide_buffer_copy(nullptr, a, device(), b),
                   halide_error_code_device_buffer_copy_failed);
    ASSERT_EQ(halide_buffer_copy(nullptr, a, device(), b), 0) << errors;
    ASSERT_EQ(b.copy_to_host(), 0);
    EXPECT_TRUE(b.all_equal(3.0f));
    a.set_device_dirty(false);
  }
  int major = 0, minor = 0;
  for (int nth = 1; nth <= 2; nth++) {
    retrograde_simt_fail_call("cuDeviceGetAttribute", nth, cuda::unknown_error);
    expect_failure("cuDeviceGetAttribute", device()->compute_capability(nullptr, &major, &minor),
                   halide_error_code_generic_error);
  }
  expect_nothing_left();
}

// ---- failures of launches, and of clean-up ----

TEST_F(GpuFailures, AKernelThatFailsLosesTheDeviceAndNoData) {
  Program program;
  for (int nth = 1; nth <= 2; nth++) {
    retrograde_simt_fail_call("kernel", nth, cuda::launch_failed);
    errors.clear();
    EXPECT_LT(program.run(), 0);
    EXPECT_NE(errors.find("CUDA_ERROR_LAUNCH_FAILED"), std::string::npos) << errors;
    EXPECT_LT(program.run(), 0) << "until it is released";
    expect_nothing_left();
    errors.clear();
    ASSERT_EQ(program.run(), 0) << errors;
    EXPECT_TRUE(program.is_right());
  }
}

TEST_F(GpuFailures, WhatCannotBeGivenBackIsTriedAgain) {
  Program program;
  for (const char* function : {"cuMemFree_v2", "cuModuleUnload", "cuDevicePrimaryCtxRelease_v2",
                               "cuCtxSetCurrent", "cuCtxGetCurrent"}) {
    ASSERT_EQ(program.run(), 0) << errors;
    errors.clear();
    retrograde_simt_fail_call(function, 1, cuda::unknown_error);
    halide_device_release(nullptr, device());
    EXPECT_EQ(retrograde_simt_call_off(), 0) << function;
    EXPECT_NE(errors.find(function), std::string::npos) << errors;
    expect_nothing_left();
  }
}

TEST_F(GpuFailures, ErrorsHaveTextWithoutTheDriversHelp) {
  for (const char* function : {"cuGetErrorName", "cuGetErrorString"}) {
    errors.clear();
    Buffer<float> b(8, 8);
    retrograde_simt_fail_call("cuMemAlloc_v2", 1, cuda::unknown_error);
    retrograde_simt_fail_call(function, 1, cuda::unknown_error);
    EXPECT_EQ(b.device_malloc(device()), halide_error_code_device_malloc_failed);
    EXPECT_EQ(retrograde_simt_call_off(), 0);
    EXPECT_NE(errors.find("999"), std::string::npos) << errors;
  }
}

}  // namespace
