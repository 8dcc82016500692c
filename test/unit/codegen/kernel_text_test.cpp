// Properties of the PTX of kernels: 32-bit addresses of shared memory, fused index products,
// 16-byte accesses to aligned buffers. Unaligned buffers must give correct results, too.
#include <gtest/gtest.h>
#include <retrograde/retrograde.h>

#include <regex>

#include "codegen/device/kernel_code.h"
#include "lower/lower.h"
#include "simt/simt_driver.h"
#include "support/gpu_programs.h"
#include "support/simulated_device.h"

namespace retrograde {
namespace {

codegen::KernelCode code_of(const Func& f) {
  const std::vector<graph::FuncPtr> outputs = Pipeline(f).spec().outputs;
  lower::LowerOptions lowering;
  lowering.target = with_gpu();
  codegen::Options options;
  options.target = with_gpu();
  return codegen::compile_kernels(
      lower::lower("f", outputs, lower::infer_arguments(outputs), lowering), options);
}

size_t times(const std::string& text, const std::string& pattern) {
  const std::regex expression(pattern);
  return static_cast<size_t>(
      std::distance(std::sregex_iterator(text.begin(), text.end(), expression), {}));
}

TEST(KernelText, SharedMemoryHasAddressesOf32Bits) {
  const std::string text = code_of(gpu_programs::named("separable_blur").build(true)).ptx;
  EXPECT_GT(times(text, R"(st\.shared\.f32\s+\[%r\d)"), 0u) << text;
  EXPECT_EQ(times(text, R"((ld|st)\.shared\.f32[^\n]*\[%rd)"), 0u) << text;
}

TEST(KernelText, ProductsOfIndicesAreOneInstruction) {
  for (const char* name : {"tone_curve", "separable_blur", "matrix_product"}) {
    const std::string text = code_of(gpu_programs::named(name).build(true)).ptx;
    EXPECT_EQ(times(text, R"(mul\.lo\.s64)"), 0u) << name << "\n" << text;
  }
}

TEST(KernelText, StreamingProgramsKeepNothingInLocalMemory) {
  for (const gpu_programs::Program& program : gpu_programs::all()) {
    for (const auto& kernel : code_of(program.build(true)).kernels)
      EXPECT_EQ(kernel.local_bytes, 0) << program.name << ", " << kernel.name;
  }
}

// ---- vectors ----

class KernelVectors : public testing::Test {
 protected:
  // Doubles the image, with one thread for four points of a row.
  template <typename T>
  Func twice(const Buffer<T>& in, int lanes) {
    Var x("x"), y("y"), xi("xi"), yi("yi");
    Func out("out");
    out(x, y) = in(x, y) + in(x, y);
    out.vectorize(x, lanes, TailStrategy::RoundUp)
        .gpu_tile(x, y, xi, yi, 8, 4, TailStrategy::RoundUp);
    return out;
  }
  Buffer<float> image(int width, int height) {
    Buffer<float> result(width, height);
    result.for_each_element([&](int x, int y) { result(x, y) = static_cast<float>(x + 100 * y); });
    return result;
  }
  void TearDown() override {
    retrograde_simt_options options;
    retrograde_simt_get_options(&options);
    options.profile = 0;
    retrograde_simt_set_options(&options);
  }
  retrograde_simt_profile profile_of(Func f, Buffer<float>& out) {
    retrograde_simt_options options;
    retrograde_simt_get_options(&options);
    options.profile = 1;
    retrograde_simt_set_options(&options);
    retrograde_simt_reset_profile();
    f.realize(out, with_gpu());
    out.copy_to_host();
    retrograde_simt_profile profile = {};
    retrograde_simt_get_profile(nullptr, &profile);
    return profile;
  }
};

TEST_F(KernelVectors, AreOneAccessUnderAGuard) {
  const std::string text = code_of(twice(image(64, 32), 4)).ptx;
  EXPECT_EQ(times(text, R"(ld\.global\.nc\.v4\.f32)"), 1u) << text;
  EXPECT_EQ(times(text, R"(st\.global\.v4\.f32)"), 1u) << text;
  EXPECT_EQ(times(text, R"(ld\.global\.nc\.f32)"), 4u) << "for images that are not aligned\n"
                                                       << text;
  EXPECT_EQ(times(text, "__local_depot"), 0u) << text;
}

TEST_F(KernelVectors, OfBytesAreOneAccess) {
  const std::string text = code_of(twice(Buffer<uint8_t>(64, 32), 4)).ptx;
  EXPECT_GE(times(text, R"(ld\.global\.nc\.(v4\.u8|u32|b32))"), 1u) << text;
}

TEST_F(KernelVectors, AskOncePerWarpAndForNoSectorMore) {
  const Buffer<float> in = image(64, 32);
  Buffer<float> out(64, 32);
  const retrograde_simt_profile profile = profile_of(twice(in, 4), out);
  // 512 threads, 16 warps, each loads and stores once.
  EXPECT_EQ(profile.global_requests, 32);
  EXPECT_EQ(profile.global_sectors, profile.ideal_sectors);
  for (int y = 0; y < 32; ++y) {
    for (int x = 0; x < 64; ++x) ASSERT_EQ(out(x, y), 2 * in(x, y));
  }
}

TEST_F(KernelVectors, OfImagesThatAreNotAlignedAreRight) {
  Buffer<float> whole = image(70, 32);
  for (int shift = 0; shift < 5; ++shift) {
    Buffer<float> in = whole.cropped(0, shift, 64);
    in.set_min(0, 0);
    Buffer<float> out(64, 32);
    const retrograde_simt_profile profile = profile_of(twice(in, 4), out);
    for (int y = 0; y < 32; ++y) {
      for (int x = 0; x < 64; ++x) ASSERT_EQ(out(x, y), 2 * whole(x + shift, y)) << shift;
    }
    EXPECT_GT(profile.global_requests, 32) << "rows of 70 elements are not aligned";
  }
}

}  // namespace
}  // namespace retrograde
