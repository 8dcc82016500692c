// Helpers for tests of the GPU runtime: a pipeline of one kernel as generated code would run it, a test fixture, and
// streams and graphs that belong to the program.
#pragma once

#include <HalideBuffer.h>
#include <HalideRuntimeCuda.h>
#include <gtest/gtest.h>

#include <string>

#include "gpu/gpu_calls.h"
#include "support/gpu_kernels.h"
#include "support/simulated_fixture.h"

namespace gpu_testing {

namespace cuda = retrograde::cuda;
using gpu_kernels::Image;
using Halide::Runtime::Buffer;

inline Buffer<float> ramp(int width, int height = 1) {
  Buffer<float> b(width, height);
  b.for_each_element([&](int x, int y) { b(x, y) = static_cast<float>(x + 1000 * y); });
  b.set_host_dirty();
  return b;
}

// Reads an element on the host through a const Buffer, because writable access would set host_dirty.
template <typename T>
T at(const Buffer<T>& b, int x, int y) {
  return b(x, y);
}

// Changes elements on the host without marking them as newer than the device's.
template <typename T>
void spoil_host(Buffer<T>& b) {
  b.fill(static_cast<T>(-1));
  b.set_host_dirty(false);
}

// The kernels of one pipeline, as generated code registers them.
struct Saxpy {
  Image image{gpu_kernels::saxpy_kernel()};
  void* state = nullptr;
  ~Saxpy() { retrograde_gpu_forget_kernels(image.source()); }

  int load(void* user = nullptr) {
    return halide_cuda_initialize_kernels(user, &state, image.source(), Image::bytes);
  }
  int launch(halide_buffer_t* x, halide_buffer_t* y, float a, int n, void* user = nullptr) {
    size_t sizes[] = {8, 8, 4, 4, 0};
    void* args[] = {x, y, &a, &n};
    int8_t is_buffer[] = {1, 1, 0, 0, 0};
    const int blocks = (n + 127) / 128;
    return halide_cuda_run(user, state, "saxpy", blocks, 1, 1, 128, 1, 1, 0, sizes, args,
                           is_buffer);
  }
  // y = a x + y, with y left on the device.
  int run(halide_buffer_t* x, halide_buffer_t* y, float a, void* user = nullptr) {
    int code = load(user);
    if (code == 0) code = halide_copy_to_device(user, x, device());
    if (code == 0) code = halide_copy_to_device(user, y, device());
    if (code == 0) code = launch(x, y, a, static_cast<int>(y->number_of_elements()), user);
    if (code == 0) y->set_device_dirty();
    halide_cuda_finalize_kernels(user, state);
    return code;
  }
};

// Restores the handlers and settings that a test may change.
class GpuRuntime : public SimulatedDevice {
 protected:
  ~GpuRuntime() override {
    halide_set_gpu_device(0);
    halide_set_cuda_acquire_context(nullptr);
    halide_set_cuda_get_stream(nullptr);
    retrograde_set_device_allocator(nullptr, nullptr);
  }
  void expect_error(int code, int expected, std::initializer_list<const char*> parts) {
    EXPECT_EQ(code, expected) << errors;
    for (const char* part : parts)
      EXPECT_NE(errors.find(part), std::string::npos) << part << "\nin: " << errors;
    errors.clear();
  }
};

inline void expect_saxpy(const Buffer<float>& y, float a) {
  for (int i = 0; i < y.width(); i++)
    ASSERT_EQ(y(i, 0), a * static_cast<float>(i) + static_cast<float>(i)) << i;
}

// Handlers that give the runtime the program's own context and the stream in it.
inline cuda::Context user_context_made = nullptr;
inline cuda::Stream user_stream = nullptr;
inline int acquire_users(void*, void** context, bool) {
  *context = user_context_made;
  return 0;
}
inline int get_users_stream(void*, void* context, void** stream) {
  EXPECT_EQ(context, user_context_made);
  *stream = user_stream;
  return 0;
}

// A context and a stream that the program owns and passes to the runtime.
class GivenStream {
 public:
  GivenStream() {
    EXPECT_EQ(cuda::cuInit(0), cuda::success);
    EXPECT_EQ(cuda::cuCtxCreate_v2(&user_context_made, 0, 0), cuda::success);
    EXPECT_EQ(cuda::cuStreamCreate(&user_stream, 1), cuda::success);
    halide_set_cuda_acquire_context(acquire_users);
    halide_set_cuda_get_stream(get_users_stream);
  }
  ~GivenStream() {
    halide_device_release(nullptr, device());
    halide_set_cuda_acquire_context(nullptr);
    halide_set_cuda_get_stream(nullptr);
    EXPECT_EQ(cuda::cuCtxDestroy_v2(user_context_made), cuda::success);
  }
};

// During its lifetime, calls use the default stream instead of the program's.
class OnDefaultStream {
 public:
  OnDefaultStream() { halide_set_cuda_get_stream(nullptr); }
  OnDefaultStream(const OnDefaultStream&) = delete;
  ~OnDefaultStream() { halide_set_cuda_get_stream(get_users_stream); }
};

// A graph of the work that is issued on the program's stream between begin and end.
class CapturedGraph {
 public:
  CapturedGraph() = default;
  CapturedGraph(const CapturedGraph&) = delete;
  ~CapturedGraph() {
    EXPECT_EQ(cuda::cuGraphExecDestroy(exec_), cuda::success);
    EXPECT_EQ(cuda::cuGraphDestroy(graph_), cuda::success);
  }

  void begin() { ASSERT_EQ(cuda::cuStreamBeginCapture_v2(user_stream, 0), cuda::success); }
  void end() {
    ASSERT_EQ(cuda::cuStreamEndCapture(user_stream, &graph_), cuda::success);
    ASSERT_EQ(cuda::cuGraphInstantiateWithFlags(&exec_, graph_, 0), cuda::success);
  }
  void launch(int times) {
    for (int i = 0; i < times; i++)
      ASSERT_EQ(cuda::cuGraphLaunch(exec_, user_stream), cuda::success);
  }

 private:
  cuda::Graph graph_ = nullptr;
  cuda::GraphExec exec_ = nullptr;
};

}  // namespace gpu_testing
