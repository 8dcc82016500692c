// gradient.cpp -- see gradient.h.
#include "gradient.h"

namespace kernels {

namespace {

std::vector<int> sizes_of(const Buffer<real>& values) {
  std::vector<int> sizes;
  for (int d = 0; d < values.dimensions(); d++) sizes.push_back(values.dim(d).extent());
  return sizes;
}

#ifdef BENCH_FLOAT64
// Adjoints are stored in floats.
Derivative derivative_of(const Func& output, const Buffer<real>& seed) {
  Region bounds;
  for (int size : sizes_of(seed)) bounds.push_back({0, size});
  const std::vector<Var> vars(bounds.size());
  Func adjoint("adjoint");
  adjoint(vars) = seed(std::vector<Expr>(vars.begin(), vars.end()));
  return propagate_adjoints(output, adjoint, bounds);
}
#else
Derivative derivative_of(const Func& output, const Buffer<real>& seed) {
  return propagate_adjoints(output, seed);
}
#endif

// An operator's sizes are constants at compile time.
void add_output(Kernel& kernel, std::vector<Func>& funcs, const Setup& setup, Func func,
                const std::vector<int>& sizes) {
  Region all;
  for (size_t d = 0; d < sizes.size(); d++) {
    all.push_back({0, sizes[d]});
    if (setup.is_operator) func.output_buffer().dim(static_cast<int>(d)).set_bounds(0, sizes[d]);
  }
  func.set_estimates(all);
  funcs.push_back(func);
  kernel.outputs.push_back(Buffer<real>(sizes));
}

}  // namespace

Kernel gradients_of(const Setup& setup, const Func& output, const std::vector<int>& output_sizes,
                    const std::vector<Buffer<real>>& by, double operations,
                    const std::vector<Buffer<real>>& fixed) {
  const Buffer<real> seed = make_noise(output_sizes);
  if (setup.primal) {
    Kernel primal{Pipeline(output), {}, {Buffer<real>(output_sizes)}, operations};
    primal.inputs.insert(primal.inputs.end(), by.begin(), by.end());
    primal.inputs.push_back(seed);
    return primal;
  }
  Kernel kernel;
  kernel.operations = operations;
  kernel.by = by.size();
  const Stopwatch deriving;
  Derivative derivative = derivative_of(output, seed);
  kernel.derive_seconds = deriving.seconds();
  std::vector<Func> funcs;
  for (const Buffer<real>& input : by) {
    add_output(kernel, funcs, setup, derivative(input), sizes_of(input));
    kernel.inputs.push_back(input);
  }
  if (setup.is_operator) add_output(kernel, funcs, setup, output, output_sizes);
  kernel.inputs.insert(kernel.inputs.end(), fixed.begin(), fixed.end());
  kernel.inputs.push_back(seed);
  kernel.pipeline = Pipeline(funcs);
  const Stopwatch searching;
  schedule(kernel.pipeline, setup);
  kernel.search_seconds = searching.seconds();
  return kernel;
}

void schedule_kernel(Kernel& kernel, const Setup& setup) {
  size_t next = 0;
  for (Func output : kernel.pipeline.outputs()) {
    const Buffer<>& values = kernel.outputs.at(next);
    next += output.outputs();
    Region all;
    for (int d = 0; d < values.dimensions(); d++)
      all.push_back({values.dim(d).min(), values.dim(d).extent()});
    output.set_estimates(all);
  }
  const Stopwatch searching;
  schedule(kernel.pipeline, setup);
  kernel.search_seconds = searching.seconds();
}

Buffer<real> make_noise(const std::vector<int>& sizes, uint32_t which) {
  Buffer<real> noise(sizes);
  for (size_t i = 0; i < noise.number_of_elements(); i++) {
    noise.data()[i] =
        static_cast<float>(scrambled(static_cast<uint32_t>(i) + which) >> 8) / 8388608 - 1;
  }
  return noise;
}

Buffer<real> make_values(const std::vector<int>& sizes, float low, float high) {
  const Buffer<float> image = make_image<float>(sizes);
  Buffer<real> values(sizes);
  for (size_t i = 0; i < values.number_of_elements(); i++)
    values.data()[i] = low + (high - low) * image.data()[i];
  return values;
}

}  // namespace kernels
