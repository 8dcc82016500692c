// A program that defines Halide's functions for contexts and streams itself. The static library
// that a generator wrote, with the runtime inside, must call these.
#include <HalideBuffer.h>
#include <HalideRuntimeCuda.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <vector>

#include "gpu/driver_types.h"
#include "gpu_filter_alone.h"
#include "support/gpu_filter_testing.h"
#include "support/simulated_fixture.h"

namespace cuda = retrograde::cuda;

namespace {

cuda::Context context_made = nullptr;
cuda::Stream stream_made = nullptr;
std::vector<void*> users;  // the user context of each request
int streams_given = 0, contexts_held = 0;

}  // namespace

extern "C" int halide_cuda_acquire_context(void* user_context, void** context, bool) {
  users.push_back(user_context);
  contexts_held++;
  *context = context_made;
  return 0;
}
extern "C" int halide_cuda_release_context(void*) {
  contexts_held--;
  return 0;
}
extern "C" int halide_cuda_get_stream(void*, void* context, void** stream) {
  EXPECT_EQ(context, context_made);
  streams_given++;
  *stream = stream_made;
  return 0;
}

namespace {

using namespace gpu_filter_testing;

TEST(AotGpuHandlers, ContextAndStreamAreTheProgramsOwn) {
  setenv("RETROGRADE_GPU", "simulated", 1);
  ASSERT_EQ(cuda::cuInit(0), cuda::success);
  ASSERT_EQ(cuda::cuCtxCreate_v2(&context_made, 0, 0), cuda::success);
  ASSERT_EQ(cuda::cuStreamCreate(&stream_made, 1), cuda::success);
  ASSERT_EQ(cuda::cuCtxSetCurrent(nullptr), cuda::success);
  {
    Buffer<float, 2> in = input(64, 32), out(64, 32);
    int user = 0;
    ASSERT_EQ(gpu_filter_alone(&user, in, 2.0f, out), 0);
    EXPECT_GT(streams_given, 0);
    EXPECT_EQ(contexts_held, 0) << "what was acquired was released";
    EXPECT_EQ(std::count(users.begin(), users.end(), &user), static_cast<int64_t>(users.size()));
    EXPECT_EQ(live_objects().contexts, 1) << "no other was made";
    expect_work_on(context_made, stream_made);
    ASSERT_EQ(out.copy_to_host(), 0);
    expect_filtered(in, 2.0f, out);
  }
  halide_device_release(nullptr, halide_cuda_device_interface());
  EXPECT_EQ(live_objects().modules, 0);
  EXPECT_EQ(live_objects().allocations, 0);
  EXPECT_EQ(cuda::cuCtxDestroy_v2(context_made), cuda::success);
}

}  // namespace
