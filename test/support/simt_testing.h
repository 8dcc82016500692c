// Helpers for tests of the simulated device: a context, and kernels over an array.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "support/gpu_kernels.h"
#include "support/simulated_driver.h"

namespace simt_testing {

using namespace retrograde::cuda;
using namespace gpu_kernels;

constexpr int32_t orders[] = {retrograde_simt_forward, retrograde_simt_reverse,
                              retrograde_simt_random, retrograde_simt_warp_ahead};

// A fixture with a context, a stream, and arrays in device memory.
class Simt : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_EQ(cuInit(0), success);
    ASSERT_EQ(cuCtxCreate_v2(&context, 0, 0), success);
    ASSERT_EQ(cuStreamCreate(&stream, 0), success);
  }
  void TearDown() override {
    cuCtxDestroy_v2(context);
    EXPECT_EQ(live_objects().allocations, 0);
    EXPECT_EQ(live_objects().contexts, 0);
  }

  Address allocate(size_t bytes) {
    Address address = 0;
    EXPECT_EQ(cuMemAlloc_v2(&address, bytes), success);
    return address;
  }
  template <typename T>
  Address upload(const std::vector<T>& values) {
    const Address address = allocate(values.size() * sizeof(T));
    EXPECT_EQ(cuMemcpyHtoDAsync_v2(address, values.data(), values.size() * sizeof(T), stream),
              success);
    return address;
  }
  template <typename T>
  std::vector<T> download(Address address, size_t count) {
    std::vector<T> values(count);
    EXPECT_EQ(cuMemcpyDtoHAsync_v2(values.data(), address, count * sizeof(T), stream), success);
    EXPECT_EQ(cuStreamSynchronize(stream), success);
    return values;
  }

  Function function_of(const Image& image, const char* name) {
    Module module = nullptr;
    Function function = nullptr;
    EXPECT_EQ(cuModuleLoadDataEx(&module, image.source(), 0, nullptr, nullptr), success);
    EXPECT_EQ(cuModuleGetFunction(&function, module, name), success);
    return function;
  }

  struct Shape {
    unsigned blocks_x, blocks_y, threads_x, threads_y, shared_bytes;
  };
  Result launch(Function f, Shape s, std::vector<void*> args) {
    return cuLaunchKernel(f, s.blocks_x, s.blocks_y, 1, s.threads_x, s.threads_y, 1, s.shared_bytes,
                          stream, args.data(), nullptr);
  }

  // Runs a kernel over an array of zeros and waits for its end; then `left` has the contents of the array.
  template <void (*body)(Thread*, int32_t*, int32_t)>
  Result run(bool waits, Shape shape, int32_t n) {
    const Image image{array_kernel<body>("kernel", waits)};
    Address data = upload(std::vector<int32_t>(static_cast<size_t>(n)));
    if (const Result r = launch(function_of(image, "kernel"), shape, {&data, &n}); r != success)
      return r;
    const Result result = cuStreamSynchronize(stream);
    if (result == success) left = download<int32_t>(data, static_cast<size_t>(n));
    return result;
  }
  // Runs a kernel that must fail with an error that contains all these parts.
  template <void (*body)(Thread*, int32_t*, int32_t)>
  void expect_finding(bool waits, Shape shape, int32_t n, Result result,
                      const std::vector<std::string>& parts) {
    EXPECT_EQ(run<body>(waits, shape, n), result);
    const std::string text = retrograde_simt_last_finding();
    for (const std::string& part : parts)
      EXPECT_NE(text.find(part), std::string::npos) << part << "\nin: " << text;
  }

  SimulatedOptions options;
  Context context = nullptr;
  Stream stream = nullptr;
  std::vector<int32_t> left;
};

template <int pitch, bool with_barrier>
void transpose_image(Function f, Address in, Address out, int32_t n, Stream stream) {
  void* args[] = {&in, &out, &n};
  const auto blocks = static_cast<unsigned>(n / 32);
  ASSERT_EQ(cuLaunchKernel(f, blocks, blocks, 1, 32, 8, 1, 32 * pitch * sizeof(float), stream, args,
                           nullptr),
            success);
}

inline void add_by_all(Thread* t, int32_t* data, int32_t) { add_atomically(t, data, 1, 0); }

}  // namespace simt_testing
