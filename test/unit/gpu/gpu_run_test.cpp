// Pipelines with GPU schedules, run by the simulated device, give the CPU's results.
#include <gtest/gtest.h>
#include <retrograde/retrograde.h>

#include <cmath>
#include <functional>

#include "support/simulated_device.h"

namespace retrograde {
namespace {

Buffer<float> ramp(int width, int height) {
  Buffer<float> image(width, height);
  image.for_each_element([&](int x, int y) { image(x, y) = float((x * 7 + y * 13) % 101) / 8; });
  return image;
}

// Defines a pipeline twice, once scheduled for the GPU.
using Define = std::function<void(Func& out, bool on_gpu)>;
void agrees(const std::vector<int>& sizes, const Define& define) {
  Func on_host("on_host"), out("out");
  define(on_host, false);
  define(out, true);
  Buffer<float> expected = on_host.realize(sizes, get_host_target());
  Buffer<float> got = out.realize(sizes, with_gpu());
  ASSERT_EQ(got.number_of_elements(), expected.number_of_elements());
  for (size_t i = 0; i < got.number_of_elements(); ++i)
    ASSERT_EQ(got.data()[i], expected.data()[i]) << "element " << i;
}

class GpuRun : public testing::Test {
 protected:
  Var x{"x"}, y{"y"}, xi{"xi"}, yi{"yi"}, u{"u"};
};

TEST_F(GpuRun, PointsOfTiles) {
  const Buffer<float> in = ramp(100, 60);
  agrees({100, 60}, [&](Func& out, bool on_gpu) {
    out(x, y) = in(x, y) * 2.0f + 1.0f;
    if (on_gpu) out.gpu_tile(x, y, xi, yi, 16, 8);
  });
}

TEST_F(GpuRun, TailsOfEveryKind) {
  const Buffer<float> in = ramp(101, 61);
  for (const TailStrategy tail : {TailStrategy::GuardWithIf, TailStrategy::ShiftInwards}) {
    agrees({101, 61}, [&](Func& out, bool on_gpu) {
      out(x, y) = in(x, y) * 2.0f + 1.0f;
      if (on_gpu) out.gpu_tile(x, y, xi, yi, 16, 8, tail);
    });
  }
}

TEST_F(GpuRun, ATileInSharedMemory) {
  const Buffer<float> in = ramp(130, 70);
  agrees({128, 68}, [&](Func& out, bool on_gpu) {
    Func rows("rows");
    rows(x, y) = in(x, y) + in(x + 1, y) + in(x + 2, y);
    out(x, y) = rows(x, y) + rows(x, y + 1) + rows(x, y + 2);
    if (on_gpu) {
      out.gpu_tile(x, y, xi, yi, 16, 8);
      rows.compute_at(out, x).gpu_threads(x, y);
    }
  });
}

TEST_F(GpuRun, TheHostComputesBetweenKernels) {
  const Buffer<float> in = ramp(100, 1);
  agrees({100}, [&](Func& out, bool on_gpu) {
    Func first("first"), second("second");
    first(x) = in(x, 0) * 3.0f;
    second(x) = first(x) + 1.0f;
    out(x) = second(x) * first(x);
    first.compute_root();
    second.compute_root();
    if (on_gpu) {
      first.gpu_tile(x, xi, 32);
      out.gpu_tile(x, xi, 32);
    }
  });
}

TEST_F(GpuRun, UpdatesAreKernelsOfTheirOwn) {
  const Buffer<float> in = ramp(64, 40);
  agrees({64}, [&](Func& out, bool on_gpu) {
    RDom r(0, 40, "r");
    out(x) = 1.0f;
    out(x) += in(x, r);
    if (on_gpu) {
      out.gpu_tile(x, xi, 16);
      out.update().gpu_tile(x, xi, 16);
    }
  });
}

TEST_F(GpuRun, VectorsInsideOfThreads) {
  const Buffer<float> in = ramp(128, 32);
  agrees({128, 32}, [&](Func& out, bool on_gpu) {
    out(x, y) = in(x, y) + in(x, y) * in(x, y);
    if (on_gpu) out.vectorize(x, 4).gpu_tile(x, y, xi, yi, 8, 4);
  });
}

TEST_F(GpuRun, FewerThreadsThanIterationsTakeTurns) {
  const Buffer<float> in = ramp(200, 1);
  agrees({128}, [&](Func& out, bool on_gpu) {
    Func sums("sums");
    sums(x) = in(x, 0) + 1.0f;
    out(x) = sums(x) + sums(x + 9) + sums(x + 50);
    if (on_gpu) {
      out.gpu_tile(x, xi, 32, TailStrategy::RoundUp);
      sums.compute_at(out, x).split(x, x, u, 16).gpu_threads(u);
    }
  });
}

TEST_F(GpuRun, AHistogramByAtomicUpdates) {
  const Buffer<float> in = ramp(256, 16);
  agrees({16}, [&](Func& out, bool on_gpu) {
    RDom r(0, 256, 0, 16, "r");
    Func counts("counts");
    counts(x) = 0;
    counts(clamp(cast<int>(in(r.x, r.y)), 0, 15)) += 1;
    out(x) = cast<float>(counts(x));
    counts.compute_root();
    if (on_gpu) {
      RVar ro("ro"), ri("ri");
      counts.gpu_tile(x, xi, 16);
      counts.update().atomic().split(r.x, ro, ri, 32).gpu_blocks(r.y, ro).gpu_threads(ri);
    }
  });
}

TEST_F(GpuRun, OneThreadDoesAll) {
  const Buffer<float> in = ramp(40, 1);
  agrees({40}, [&](Func& out, bool on_gpu) {
    RDom r(1, 39, "r");
    out(x) = in(x, 0);
    out(r) += out(r - 1);
    if (on_gpu) {
      out.gpu_tile(x, xi, 8);
      out.update().gpu_single_thread();
    }
  });
}

// A call's context that selects the device, and counts the queries.
struct Caller : JITUserContext {
  Caller() {
    handlers.custom_cuda_get_stream = [](JITUserContext* self, void* context, void** stream) {
      auto& caller = *static_cast<Caller*>(self);
      caller.streams++;
      caller.context = context;
      *stream = nullptr;
      return caller.stream_code;
    };
  }
  void give_context(void* given) {
    context = given;
    handlers.custom_cuda_acquire_context = [](JITUserContext* self, void** acquired, bool) {
      auto& caller = *static_cast<Caller*>(self);
      caller.acquired++;
      *acquired = caller.context;
      return 0;
    };
    handlers.custom_cuda_release_context = [](JITUserContext* self) {
      static_cast<Caller*>(self)->released++;
      return 0;
    };
  }
  void* context = nullptr;
  int acquired = 0, released = 0, streams = 0, stream_code = 0;
};

TEST_F(GpuRun, ACallHasItsOwnContextAndStream) {
  Func out("out");
  out(x, y) = cast<float>(x + y);
  out.gpu_tile(x, y, xi, yi, 16, 8);
  Pipeline pipeline(out);
  Caller first;
  Buffer<float> result = pipeline.realize(&first, {32, 16}, with_gpu());
  EXPECT_EQ(result(3, 4), 7.0f);
  EXPECT_GT(first.streams, 0);

  Caller second;
  second.give_context(first.context);
  result = pipeline.realize(&second, {32, 16}, with_gpu());
  EXPECT_EQ(result(3, 4), 7.0f);
  EXPECT_GT(second.acquired, 0);
  EXPECT_EQ(second.released, second.acquired);

  Caller failing;
  failing.stream_code = 17;
  try {
    pipeline.realize(&failing, {32, 16}, with_gpu());
    FAIL() << "what the handler gave was ignored";
  } catch (const RuntimeError& error) {
    EXPECT_NE(std::string(error.what()).find("get_stream gave 17"), std::string::npos)
        << error.what();
  }
}

TEST_F(GpuRun, GradientsRunOnGpus) {
  const Buffer<float> in = ramp(66, 34);
  agrees({66, 34}, [&](Func& out, bool on_gpu) {
    Func image("image"), blurred("blurred"), loss("loss");
    RDom r(0, 64, 0, 32, "r");
    image(x, y) = in(x, y);
    blurred(x, y) = image(x, y) + image(x + 1, y) + image(x, y + 2);
    loss() = 0.0f;
    loss() += blurred(r.x, r.y) * blurred(r.x, r.y);
    Derivative d = propagate_adjoints(loss);
    Func gradient = d(image);
    image.compute_root();
    if (on_gpu) gradient.gpu_tile(x, y, xi, yi, 16, 8);
    out = gradient;
  });
}

// The profiler measures the host's time, in the host's memory.
TEST_F(GpuRun, KernelsDoNotTellTheProfiler) {
  Func rows("rows"), out("out");
  rows(x, y) = cast<float>(x * y);
  out(x, y) = rows(x, y) + rows(x, y + 1);
  out.gpu_tile(x, y, xi, yi, 16, 8);
  rows.compute_at(out, x).gpu_threads(x, y);
  const Buffer<float> found = out.realize({32, 16}, with_gpu().with_feature(Target::Profile));
  EXPECT_EQ(found(31, 15), 31.0f * 15 + 31.0f * 16);
}

// ---- device arithmetic, bit for bit, on any machine ----

template <typename T>
std::vector<uint8_t> bytes_of(const Buffer<T>& buffer) {
  const auto* begin = reinterpret_cast<const uint8_t*>(buffer.data());
  return {begin, begin + buffer.size_in_bytes()};
}

TEST_F(GpuRun, BitsDoNotDependOnTheProcessorOfTheHost) {
  if (get_host_target().arch != Target::X86) GTEST_SKIP() << "older processors are of x86";
  const Buffer<float> in = ramp(128, 32);
  const auto on = [&](const std::string& host) {
    Func out("out");
    const Expr a = in(x, y) / 7.0f, b = in(127 - x, y) - 5.0f;
    const Expr half = cast<float>(cast<float16_t>(a * b + 1.0f));
    out(x, y) = a * b + sin(a) * exp(-b) - pow(a, b) * half + fast_exp(b) * a + sqrt(a) / b;
    out.vectorize(x, 2).gpu_tile(x, y, xi, yi, 8, 4);
    return bytes_of(Buffer<float>(out.realize({128, 32}, Target(host))));
  };
  const auto plain = on("x86-64-linux-cuda-cuda_capability_80");
  EXPECT_EQ(on("x86-64-linux-sse41-avx-avx2-f16c-fma-cuda-cuda_capability_80"), plain);
  EXPECT_EQ(on(with_gpu().to_string()), plain);
}

// PTX ISA, cvt: the nearest representable integer; NaN gives 0, or the sign bit if one side has 64
// bits.
TEST_F(GpuRun, FloatsThatNoIntegerHoldsConvertAsOnADevice) {
  Buffer<double> in(4);
  in(0) = 1e30;
  in(1) = -1e30;
  in(2) = std::nan("");
  in(3) = -2.75;
  const auto convert = [&](Type from, Type to) {
    Func out("out");
    out(x) = cast<double>(cast(to, cast(from, in(x))));
    out.gpu_tile(x, xi, 4);
    const Buffer<double> got = out.realize({4}, with_gpu());
    return std::vector<double>(got.begin(), got.end());
  };
  using Numbers = std::vector<double>;
  EXPECT_EQ(convert(Float(32), Int(32)), (Numbers{0x1p31 - 1, -0x1p31, 0, -2}));
  EXPECT_EQ(convert(Float(32), UInt(32)), (Numbers{0x1p32 - 1, 0, 0, 0}));
  EXPECT_EQ(convert(Float(64), Int(32)), (Numbers{0x1p31 - 1, -0x1p31, -0x1p31, -2}));
  EXPECT_EQ(convert(Float(32), Int(64)), (Numbers{0x1p63, -0x1p63, -0x1p63, -2}));
  EXPECT_EQ(convert(Float(64), UInt(64)), (Numbers{0x1p64, 0, 0x1p63, 0}));
}

}  // namespace
}  // namespace retrograde
