#include "checks/slopes.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "frontend/data/image_param.h"

namespace retrograde::checks {

namespace {

// The complex step, relative to the input's size. Its square is negligible beside 1 but does not underflow.
const double tiny_step = std::ldexp(1.0, -200);

double size_of(const Input& input) { return std::max(largest(input.values), 1e-3); }

}  // namespace

Slopes::Slopes(const Func& output, const Shape& shape, const std::vector<Values>& weights,
               const std::vector<Input>& inputs)
    : shape_(shape),
      weights_(weights),
      primal_(scheduled_for(output, shape)),
      complex_(complex_graph(output)) {
  if (!complex_.refused.empty()) return;
  for (const Input& input : inputs) bind_imaginary(input);
  complex_primal_ = scheduled_for(complex_.output, shape);
}

Slopes::Difference Slopes::central(Input& input, const Values& v, double h) {
  auto at = [&](double step) {
    Values moved = input.values;
    for (size_t i = 0; i < moved.size(); ++i) moved[i] += step * v[i];
    input.set_wide(moved);
    return weighted_sum(realize_values(primal_, shape_), weights_);
  };
  auto slope = timed([&] { return (at(h) - at(-h)) / (2 * h); });
  input.set_wide(input.values);
  return {slope.value, slope.seconds};
}

Timed<double> Slopes::by_differences(Input& input, const Values& v, int smallest_step,
                                     double adjoint, double scale,
                                     std::vector<GradientReport::Step>* steps) {
  Timed<double> best{0, 0};
  double best_gap = std::numeric_limits<double>::infinity();
  double last_slope = 0, last_extrapolated = 0;
  for (int k = 4, n = 0; k <= smallest_step; k += 2, ++n) {
    Difference s = central(input, v, std::ldexp(size_of(input), -k));
    double extrapolated = n == 0 ? s.central : (16 * s.central - last_slope) / 15;
    double gap = n < 2 ? best_gap : std::abs(extrapolated - last_extrapolated);
    if (n == 0 || gap < best_gap) best.value = extrapolated, best_gap = gap;
    last_slope = s.central;
    last_extrapolated = extrapolated;
    best.seconds += s.seconds;
    if (steps)
      steps->push_back({std::ldexp(1.0, -k), relative_error(s.central, adjoint, scale),
                        relative_error(extrapolated, adjoint, scale), s.seconds});
  }
  return best;
}

void Slopes::bind_imaginary(const Input& input) {
  const auto& p = complex_.imaginary.at(input.wide.get());
  Input& to = imaginary_.emplace(input.wide.get(), input).first->second;
  to.wide = p;
  if (p->is_buffer) {
    to.buffer = new_buffer(Float(64), to.shape);
    ImageParam(p).set(to.buffer);
  }
  to.set_wide(Values(to.values.size(), 0.0));
}

Timed<double> Slopes::by_complex_step(const Input& input, const Values& v) {
  Input& moved = imaginary_.at(input.wide.get());
  const double h = tiny_step * size_of(input);
  Values step = v;
  for (double& s : step) s *= h;
  moved.set_wide(step);
  auto result = timed_warm([&] {
    std::vector<Values> parts = realize_values(complex_primal_, shape_), imaginary;
    for (size_t k = 0, at = 0; k < weights_.size(); ++k) {
      const bool is_float = !weights_[k].empty();
      imaginary.push_back(is_float ? parts[at + 1] : Values());
      at += is_float ? 2 : 1;
    }
    return weighted_sum(imaginary, weights_) / h;
  });
  moved.set_wide(Values(v.size(), 0.0));
  return result;
}

}  // namespace retrograde::checks
