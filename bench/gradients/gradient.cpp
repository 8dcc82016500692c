// gradient.cpp -- see gradient.h.
#include "gradient.h"

namespace kernels {

using namespace Halide;

namespace {

#ifdef BENCH_RETROGRADE
void schedule(Pipeline&, const Setup&) {}  // as it comes
#else
void schedule(Pipeline& pipeline, const Setup& setup) {
  load_plugin(BENCH_LI2018);
  MachineParams machine = MachineParams::generic();
  machine.parallelism = setup.threads;
  pipeline.auto_schedule("Li2018", setup.target, machine);
}
#endif

Region all_of(const Buffer<float>& values) {
  Region bounds;
  for (int d = 0; d < values.dimensions(); d++) bounds.push_back({0, values.dim(d).extent()});
  return bounds;
}

std::vector<int> sizes_of(const Buffer<float>& values) {
  std::vector<int> sizes;
  for (int d = 0; d < values.dimensions(); d++) sizes.push_back(values.dim(d).extent());
  return sizes;
}

// From -1 to 1, with no relation to any input: a seed like the input of a normalisation has a
// gradient of rounding errors.
Buffer<float> make_noise(const std::vector<int>& sizes) {
  Buffer<float> noise(sizes);
  for (size_t i = 0; i < noise.number_of_elements(); i++) {
    noise.data()[i] =
        static_cast<float>(scrambled(static_cast<uint32_t>(i) + 12345) >> 8) / 8388608 - 1;
  }
  return noise;
}

}  // namespace

Kernel gradients_of(const Setup& setup, const Func& output, const std::vector<int>& output_sizes,
                    const std::vector<Buffer<float>>& by, double operations) {
  const Buffer<float> seed = make_noise(output_sizes);
  if (setup.primal) {
    Kernel primal{Pipeline(output), {}, {Buffer<float>(output_sizes)}, operations};
    primal.inputs.insert(primal.inputs.end(), by.begin(), by.end());
    primal.inputs.push_back(seed);
    return primal;
  }
  Derivative derivative = propagate_adjoints(output, seed);
  Kernel kernel;
  std::vector<Func> gradients;
  for (const Buffer<float>& input : by) {
    Func gradient = derivative(input);
    gradient.set_estimates(all_of(input));
    gradients.push_back(gradient);
    kernel.inputs.push_back(input);
    kernel.outputs.push_back(Buffer<float>(sizes_of(input)));
  }
  kernel.inputs.push_back(seed);
  kernel.pipeline = Pipeline(gradients);
  kernel.operations = operations;
  schedule(kernel.pipeline, setup);
  return kernel;
}

Buffer<float> make_values(const std::vector<int>& sizes, float low, float high) {
  Buffer<float> values = make_image<float>(sizes);
  values.for_each_value([=](float& v) { v = low + (high - low) * v; });
  return values;
}

}  // namespace kernels
