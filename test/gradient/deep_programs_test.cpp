// Tests gradients of deep multi-resolution programs. They are generated and compiled, in process and ahead of time, in
// time that grows linearly with the program, their bounds stay small, and their values are right at odd and even sizes.
#include "gradient/deep_programs.h"

#include <ctime>
#include <random>
#include <sstream>

#include "frontend/data/param.h"
#include "frontend/run/compiler_interface.h"
#include "frontend/run/module.h"
#include "gradient/gradient_check.h"
#include "support/errors.h"

namespace retrograde::deep {
namespace {

// CPU time of this process in seconds, independent of the machine's load.
double seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

// The gradient of an output by all of its inputs, with sizes that are known at run time only.
Pipeline gradient_at_run_time(const Func& output, const std::vector<ImageParam>& by) {
  const ImageParam seed(Float(32), output.dimensions(), "seed");
  Region region;
  for (int d = 0; d < seed.dimensions(); ++d)
    region.push_back({seed.dim(d).min(), seed.dim(d).extent()});
  AdjointOptions options;
  for (const ImageParam& image : by) options.wrt.push_back(image);
  const Derivative d = propagate_adjoints(output, Func(seed), region, options);
  std::vector<Func> gradients;
  for (const ImageParam& image : by) gradients.push_back(d(image));
  return Pipeline(gradients);
}

Module module_of(Pipeline gradient) {
  return gradient.compile_to_module(gradient.infer_arguments(), "deep_gradient", get_host_target());
}

Pipeline interpolation(int levels, Border border = Border::Repeat) {
  const ImageParam input(Float(32), 3, "input");
  return gradient_at_run_time(Pyramids().interpolation(input, levels, border), {input});
}

struct Named {
  const char* name;
  std::function<Pipeline(Border)> gradient;
};
const std::vector<Named>& programs() {
  static const std::vector<Named> all = {
      {"interpolation of 10 levels", [](Border) { return interpolation(10, Border::None); }},
      {"local Laplacian of 8 levels",
       [](Border b) {
         const ImageParam input(Float(32), 3, "input");
         return gradient_at_run_time(Pyramids().local_laplacian(input, 8, b), {input});
       }},
      {"multi-grid of 4 levels",
       [](Border b) {
         const ImageParam input(Float(32), 2, "input");
         return gradient_at_run_time(Pyramids().multigrid(input, 4, b), {input});
       }},
      {"U-shaped net of 3 levels",
       [](Border) {
         const ImageParam input(Float(32), 3, "input"), weights(Float(32), 5, "weights");
         return gradient_at_run_time(Pyramids().net(input, weights, 3, 4), {input, weights});
       }},
      {"means of patches",
       [](Border) {
         const ImageParam input(Float(32), 3, "input");
         return gradient_at_run_time(Pyramids().means_of_patches(input, 3, 3, Border::None),
                                     {input});
       }},
  };
  return all;
}

// compile_to_object and generators lower to a module first: statements, no machine code yet.
TEST(DeepPrograms, ModulesTakeSeconds) {
  for (const Named& program : programs()) {
    const double start = seconds();
    module_of(program.gradient(Border::Mirror));
    EXPECT_LT(seconds() - start, 30) << program.name;
  }
}

// Doubling the levels doubles the number of Funcs.
TEST(DeepPrograms, TimeGrowsWithTheLevels) {
  const auto time = [](int levels) {
    const double start = seconds();
    module_of(interpolation(levels, Border::None));
    return seconds() - start;
  };
  time(2);
  const double few = time(4), many = time(8);
  EXPECT_LT(many, 8 * few + 0.5) << few << " s for 4 levels";
}

// The text of the schedule is built on demand and stays short, because names of regions are not expanded.
TEST(DeepPrograms, LoopNestsAndStatementsAreShort) {
  const Module module = module_of(interpolation(10, Border::None));
  const double start = seconds();
  const std::string text = module.functions().at(0).lowered.loop_nest();
  EXPECT_LT(seconds() - start, 10);
  expect_mentions(text, {"produce"});
  EXPECT_LT(text.size(), 200000u);
  std::ostringstream out;
  out << module.functions().at(0).lowered.body;
  EXPECT_LT(out.str().size(), 20000000u);
}

TEST(DeepPrograms, ObjectsAndMachineCodeTakeSeconds) {
  const double start = seconds();
  default_compiler().object(module_of(interpolation(3)));
  Pipeline jit = interpolation(3);
  jit.compile_jit();
  EXPECT_LT(seconds() - start, 40);
}

// The slope along a random direction, in double. Steps are so small that hardly any brightness passes a kink.
double slope_along(const Func& loss, Buffer<float>& image, const std::vector<float>& direction) {
  const auto moved = [&](float by) {
    const auto move = [&](float step) {
      size_t i = 0;
      image.for_each_value([&](float& v) { v += step * direction[i++]; });
    };
    move(by);
    const double result = gradient::evaluate_scalar(loss);
    move(-by);
    return result;
  };
  const float step = 1.0f / (1 << 14);
  return (moved(step) - moved(-step)) / (2.0 * step);
}

void expect_right(const Func& output, const std::vector<int>& sizes, Buffer<float> image) {
  const Func loss = gradient::weighted_sum(output, sizes);
  const Func by_image = propagate_adjoints(loss)(image);
  const oracle::Region region = oracle::region_of(*image.raw_buffer());
  const oracle::Array found = gradient::evaluate(by_image, region);
  std::mt19937 random(7);
  std::vector<float> direction;
  double reverse = 0, scale = 1;
  for (const oracle::Value& v : found.values) {
    direction.push_back(static_cast<float>(random() % 3) - 1.0f);
    reverse += v.scalar.as_double() * direction.back();
    scale += std::abs(v.scalar.as_double());
  }
  EXPECT_NEAR(reverse, slope_along(loss, image, direction), 1e-5 * scale);
  gradient::expect_machine_code_agrees(by_image, region);
}

TEST(DeepPrograms, GradientsAreRightAtOddAndEvenSizes) {
  for (const auto& [width, height] : {std::pair{11, 7}, std::pair{8, 6}}) {
    SCOPED_TRACE(std::to_string(width) + " x " + std::to_string(height));
    const Buffer<float> image = gradient::random_image({width, height, 4}, 0.25, 0.75, 3);
    expect_right(Pyramids().interpolation(image, 4, Border::Repeat), {width, height, 3}, image);
    expect_right(Pyramids().local_laplacian(image, 3, Border::Mirror), {width, height, 3}, image);
    expect_right(Pyramids().means_of_patches(image, 1, 1, Border::Mirror), {width, height, 3},
                 image);
    const Buffer<float> plane = gradient::random_image({width, height}, 0.25, 0.75, 5);
    expect_right(Pyramids().multigrid(plane, 3, Border::Zero), {width, height}, plane);
    const Buffer<float> weights = gradient::random_image({3, 3, 4, 2, 3}, -0.5, 0.5, 9);
    const Buffer<float> pair = gradient::random_image({width, height, 2}, 0.25, 0.75, 5);
    expect_right(Pyramids().net(pair, weights, 2, 2), {width, height, 2}, weights);
  }
}

}  // namespace
}  // namespace retrograde::deep
