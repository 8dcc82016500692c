// A test fixture on the simulated device: records all messages to the error handler, and checks that nothing is left
// allocated.
#pragma once

#include <HalideRuntimeCuda.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

#include "support/simulated_driver.h"

inline thread_local std::string errors;

inline const halide_device_interface_t* device() { return halide_cuda_device_interface(); }

class SimulatedDevice : public testing::Test {
 protected:
  SimulatedDevice() {
    setenv("RETROGRADE_GPU", "simulated", 1);
    errors.clear();
    halide_set_error_handler([](void*, const char* text) { errors += text; });
  }
  ~SimulatedDevice() override {
    retrograde_simt_call_off();
    halide_reuse_device_allocations(nullptr, true);
    halide_device_release(nullptr, device());
    EXPECT_EQ(live_objects().allocations, 0);
    EXPECT_EQ(live_objects().modules, 0);
    EXPECT_EQ(live_objects().contexts, 0);
    halide_set_error_handler(nullptr);
  }
  SimulatedOptions options;
};

// Expects that no context is current and that the given one has unfinished work on the stream alone. Makes it current.
inline void expect_work_on(retrograde::cuda::Context context, retrograde::cuda::Stream stream) {
  using namespace retrograde;
  cuda::Context current = &current;
  ASSERT_EQ(cuda::cuCtxGetCurrent(&current), cuda::success);
  EXPECT_EQ(current, nullptr) << "what was current is so again";
  ASSERT_EQ(cuda::cuCtxSetCurrent(context), cuda::success);
  EXPECT_EQ(cuda::cuStreamQuery(stream), cuda::not_ready) << "the work is on this stream";
  EXPECT_EQ(cuda::cuStreamQuery(nullptr), cuda::success);
}
