// slope.cpp -- see slope.h.
#include "slope.h"

#include <algorithm>
#include <cmath>

namespace kernels {

namespace {

constexpr real step = sizeof(real) == 8 ? 1.0f / (1 << 20) : 1.0f / 8192;
constexpr uint32_t directions = 3;

real* values_of(const Halide::Buffer<>& buffer) {
  return reinterpret_cast<real*>(buffer.raw_buffer()->host);
}

float sign(uint32_t direction, size_t input, size_t element) {
  const auto n = static_cast<uint32_t>(element * 8 + input);
  return scrambled(scrambled(n) + direction) & 1 ? 1.0f : -1.0f;
}

// Calls f(element, its sign) for each element of the inputs that have gradients.
template <typename F>
void along(const std::vector<Halide::Buffer<>>& buffers, size_t count, uint32_t direction, F f) {
  for (size_t i = 0; i < count; i++) {
    real* values = values_of(buffers[i]);
    for (size_t k = 0; k < buffers[i].number_of_elements(); k++)
      f(values[k], sign(direction, i, k));
  }
}

std::vector<Halide::Buffer<>> copies(const std::vector<Halide::Buffer<>>& buffers) {
  std::vector<Halide::Buffer<>> result;
  for (const auto& buffer : buffers) result.emplace_back(buffer.copy());
  return result;
}

double weighted_sum(Kernel& primal, const Halide::Target& target) {
  primal.pipeline.realize(Halide::Realization(primal.outputs), target);
  const real* seed = values_of(primal.inputs.back());
  const real* output = values_of(primal.outputs.back());
  double sum = 0;
  for (size_t k = 0; k < primal.outputs.back().number_of_elements(); k++)
    sum += static_cast<double>(seed[k]) * output[k];
  return sum;
}

}  // namespace

double slope_error(const Kernel& gradients, Kernel& primal, const Halide::Target& target) {
  const std::vector<Halide::Buffer<>> slopes = copies(gradients.outputs);
  const size_t inputs = gradients.by;
  double worst = 0;
  for (uint32_t direction = 0; direction < directions; direction++) {
    double product = 0, squares = 0;
    along(slopes, inputs, direction, [&](real g, float v) {
      product += static_cast<double>(g) * v;
      squares += static_cast<double>(g) * g;
    });
    const auto move = [&](real by) {
      along(primal.inputs, inputs, direction, [&](real& x, float v) { x += by * v; });
    };
    move(step);
    const double up = weighted_sum(primal, target);
    move(-2 * step);
    const double slope = (up - weighted_sum(primal, target)) / (2 * step);
    move(step);
    worst = std::max(worst, std::abs(product - slope) / std::sqrt(squares));
  }
  return worst;
}

}  // namespace kernels
