// Gradients are deterministic: the same bits from run to run, on 1, 2, 4 and 8 threads, with iterations taken forward
// and backward.
//
// The programs are large enough that privatised copies, rows and lanes really run in parallel. (gradient_check.h runs
// the small programs of the suite in the same way.) The values are checked against the dot product with forward mode.
#include <algorithm>

#include "autodiff/tangents.h"
#include "autoschedule/machine/reference.h"
#include "gradient/programs_large.h"

namespace retrograde::gradient {
namespace {

struct Outcome {
  std::vector<Buffer<float>> gradients;
  int longest_loop = 0;
};

class LargeGradients : public ::testing::TestWithParam<LargeProgram> {
 protected:
  Program program = GetParam().build(test_side);

  Derivative derivative() const {
    AdjointOptions options;
    if (program.store_overwritten) options.overwritten = Overwritten::Store;
    return propagate_adjoints(program.loss, options);
  }
  // All gradients in one call, scheduled for large machines: for few threads, less would run in parallel.
  Pipeline pipeline(const Derivative& d) const {
    std::vector<Func> funcs;
    for (const Buffer<float>& input : program.inputs) funcs.push_back(d(input));
    Pipeline pipeline(funcs);
    pipeline.set_autoschedule({.threads = planning::threads_of_large_machines});
    return pipeline;
  }
  Outcome run(Pipeline& p, int threads, bool backward) const {
    Outcome result;
    std::vector<Buffer<>> buffers;
    for (const Buffer<float>& input : program.inputs) {
      result.gradients.emplace_back(oracle::region_of(*Buffer<>(input).raw_buffer()).extents);
      buffers.push_back(result.gradients.back());
    }
    OwnThreads context(threads, backward);
    p.realize(&context, Realization(buffers));
    result.longest_loop = context.longest();
    return result;
  }
};

TEST_P(LargeGradients, HaveTheSameBitsOnAnyNumberOfThreads) {
  const Derivative d = derivative();
  Pipeline p = pipeline(d);
  const Outcome first = run(p, 1, false);
  EXPECT_GE(first.longest_loop,
            std::min(GetParam().least_iterations, planning::threads_of_large_machines))
      << "too little runs in parallel";
  for (int threads : {1, 2, 4, 8}) {
    for (bool backward : {false, true}) {
      const Outcome again = run(p, threads, backward);
      for (size_t i = 0; i < first.gradients.size(); ++i) {
        EXPECT_TRUE(same_bits(first.gradients[i], again.gradients[i]))
            << "gradient " << i << " on " << threads << " threads"
            << (backward ? ", backward" : "");
      }
    }
  }
}

// The same, on the threads of the runtime.
TEST_P(LargeGradients, AgreeWithForwardMode) {
  const Derivative d = derivative();
  Pipeline p = pipeline(d);
  double reverse = 0, scale = 0;
  std::vector<Direction> directions;
  std::vector<Buffer<>> gradients;
  for (const Buffer<float>& input : program.inputs)
    gradients.push_back(Buffer<float>(oracle::region_of(*Buffer<>(input).raw_buffer()).extents));
  p.realize(Realization(gradients));
  for (size_t i = 0; i < gradients.size(); ++i) {
    const Buffer<float> found = gradients[i];
    const oracle::Region region = oracle::region_of(*Buffer<>(found).raw_buffer());
    Buffer<float> v = random_image(region.extents, -1, 1, 50 + static_cast<unsigned>(i));
    directions.emplace_back(program.inputs[i], v);
    v.get()->for_each_element([&](const int* at) {
      const double term = double((*v.get())(at)) * double((*found.get())(at));
      reverse += term;
      scale += std::abs(term);
    });
  }
  Buffer<float> forward = propagate_tangents(program.loss, directions)(program.loss).realize();
  EXPECT_NEAR(double(forward()), reverse, 1e-4 * scale);
}

INSTANTIATE_TEST_SUITE_P(Programs, LargeGradients,
                         ::testing::ValuesIn(large_programs().begin(), large_programs().end()),
                         [](const auto& info) { return std::string(info.param.name); });

}  // namespace
}  // namespace retrograde::gradient
