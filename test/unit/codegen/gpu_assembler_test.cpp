// Precompiled machine code of kernels: it is loaded instead of code compiled by the driver. Without
// it, or if the driver rejects it, everything still works.
#include "gpu/assembler.h"

#include <string>
#include <vector>

#include "support/gpu_testing.h"

namespace {

using namespace gpu_testing;

struct Asked {
  std::string ptx;
  int32_t capability, driver_version;
};
std::vector<Asked> requests;
Image* other = nullptr;  // the image that is supplied

void assemble(const retrograde_assembler_request* request,
              void (*use)(void* closure, const void* code, size_t bytes), void* closure) {
  requests.push_back(
      {{request->ptx, request->ptx_bytes}, request->capability, request->driver_version});
  const char refused[64] = "no code of any device";
  if (other)
    use(closure, other->source(), Image::bytes);
  else
    use(closure, refused, sizeof refused);
}
void find_none(const retrograde_assembler_request*, void (*)(void*, const void*, size_t), void*) {}

class GpuAssembler : public GpuRuntime {
 protected:
  GpuAssembler() {
    requests.clear();
    other = nullptr;
  }
  ~GpuAssembler() override { retrograde_set_assembler(nullptr, 0); }
  void expect_right(Saxpy& saxpy) {
    Buffer<float> x = ramp(300), y = ramp(300);
    ASSERT_EQ(saxpy.run(x, y, 3.0f), 0) << errors;
    ASSERT_EQ(y.copy_to_host(), 0) << errors;
    expect_saxpy(y, 3.0f);
  }
};

// Saxpy's image, with a text for devices.
struct WithText : Saxpy {
  WithText() { image.set_ptx("// a text"); }
};

TEST_F(GpuAssembler, IsAskedWithTheTextTheChipAndTheDriversVersionOnce) {
  retrograde_set_assembler(assemble, 1);
  WithText saxpy;
  expect_right(saxpy);
  expect_right(saxpy);
  ASSERT_EQ(requests.size(), 1u);
  EXPECT_EQ(requests[0].ptx, "// a text");
  EXPECT_EQ(requests[0].capability, 90);
  EXPECT_EQ(requests[0].driver_version, 12000);
}

TEST_F(GpuAssembler, ItsCodeIsWhatRuns) {
  WithText saxpy;
  Image given{gpu_kernels::saxpy_kernel()};
  other = &given;
  retrograde_set_assembler(assemble, 1);
  const int64_t loads = retrograde_simt_call_count("cuModuleLoadDataEx");
  expect_right(saxpy);
  EXPECT_EQ(retrograde_simt_call_count("cuModuleLoadDataEx"), loads + 1);
}

TEST_F(GpuAssembler, CodeThatTheDriverDoesNotTakeIsNotMissed) {
  retrograde_set_assembler(assemble, 1);
  WithText saxpy;
  const int64_t loads = retrograde_simt_call_count("cuModuleLoadDataEx");
  expect_right(saxpy);
  EXPECT_EQ(retrograde_simt_call_count("cuModuleLoadDataEx"), loads + 2)
      << "first the code, then the text";
}

TEST_F(GpuAssembler, ItMayHaveNone) {
  retrograde_set_assembler(find_none, 1);
  WithText saxpy;
  expect_right(saxpy);
}

TEST_F(GpuAssembler, FailuresOnTheWayAreNone) {
  for (const char* function :
       {"cuDriverGetVersion", "cuDeviceGetAttribute", "cuModuleLoadDataEx"}) {
    retrograde_set_assembler(assemble, 1);
    WithText saxpy;
    retrograde_simt_fail_call(function, 1, 1);
    expect_right(saxpy);
    EXPECT_EQ(retrograde_simt_call_off(), 0) << function << " was called";
  }
}

TEST_F(GpuAssembler, TheSimulatedDeviceHasItsOwnUnlessATestAsks) {
  retrograde_set_assembler(assemble, 0);
  WithText saxpy;
  expect_right(saxpy);
  EXPECT_TRUE(requests.empty());
}

}  // namespace
