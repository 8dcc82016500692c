// Schedules the programs of the gradient suite for a GPU with Pipeline::auto_schedule. Losses and all gradients run as
// kernels on the simulated device, and agree with the CPU up to rounding.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "frontend/run/kernel_report.h"
#include "frontend/run/pipeline.h"
#include "gradient/programs_suite.h"
#include "support/program_counts.h"
#include "support/simulated_device.h"

namespace retrograde::gradient {
namespace {

// Buffers for the loss and its gradients by all inputs.
struct Outputs {
  explicit Outputs(const Program& program) : funcs{program.loss} {
    const Derivative d = propagate_adjoints(program.loss);
    buffers.push_back(Buffer<float>::make_scalar());
    for (const Buffer<float>& input : program.inputs) {
      funcs.push_back(d(input));
      buffers.emplace_back(sizes_of(input));
    }
  }
  static std::vector<int> sizes_of(const Buffer<float>& input) {
    std::vector<int> sizes;
    for (int i = 0; i < input.dimensions(); ++i) sizes.push_back(input.dim(i).extent());
    return sizes;
  }
  void run(const Target& target) {
    std::vector<Buffer<>> all(buffers.begin(), buffers.end());
    Pipeline(funcs).realize(Realization(all), target);
    for (Buffer<float>& buffer : buffers) buffer.copy_to_host();
  }

  std::vector<Func> funcs;
  std::vector<Buffer<float>> buffers;
};

class GpuGradients : public ::testing::TestWithParam<size_t> {};

TEST_P(GpuGradients, AreWhatTheCpuGives) {
  Outputs expected(programs().at(GetParam()).build()), found(programs().at(GetParam()).build());
  expected.run(get_host_target());
  const Pipeline pipeline(found.funcs);
  const std::string source = pipeline.auto_schedule(with_gpu()).schedule_source;
  SCOPED_TRACE(source);
  EXPECT_GE(explain_kernels(pipeline, with_gpu()).kernels.size(), 1u);
  found.run(with_gpu());
  for (size_t i = 0; i < found.buffers.size(); ++i) {
    double largest = 1;
    const auto values = [](const Buffer<float>& b) {
      return std::vector<float>(b.data(), b.data() + b.number_of_elements());
    };
    const std::vector<float> got = values(found.buffers[i]), wanted = values(expected.buffers[i]);
    for (const float value : wanted) {
      if (std::isfinite(value)) largest = std::max(largest, std::abs(static_cast<double>(value)));
    }
    for (size_t k = 0; k < got.size(); ++k) {
      if (!std::isfinite(wanted[k]))
        EXPECT_TRUE(std::isnan(wanted[k]) ? std::isnan(got[k]) : got[k] == wanted[k])
            << "output " << i << ", element " << k << ": " << got[k] << ", not " << wanted[k];
      else
        EXPECT_NEAR(got[k], wanted[k], 1e-4 * largest) << "output " << i << ", element " << k;
    }
  }
}

constexpr size_t step = many_or_few(1, 4);

INSTANTIATE_TEST_SUITE_P(Programs, GpuGradients,
                         ::testing::Range<size_t>(0, programs().size(), step),
                         [](const auto& program) { return programs()[program.param].name; });

}  // namespace
}  // namespace retrograde::gradient
