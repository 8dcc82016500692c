// gradient_check.cpp -- see gradient_check.h.
//
// The loss is quadratic in the grid, so its central difference is exact for any step. In the guide's parameters it has
// kinks (the hinges; a pixel that changes its layer). So the step is small enough that hardly any pixel crosses a kink,
// yet large compared with rounding in double.
#include "gradient_check.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numeric>
#include <random>
#include <vector>

#include "model.h"

namespace bilateral_slice {

namespace {

using Values = std::vector<double>;

constexpr int crop_width = 96, crop_height = 80;
constexpr int directions = 3;          // per parameter array
constexpr int single_parameters = 16;  // per parameter array, those with the largest gradients
constexpr double grid_step = 1e-3, guide_step = 1e-6;

Shape crop_shape(const Shape& whole, int side) {
  Shape crop = whole;
  crop.width = std::min(whole.width, side > 0 ? side : crop_width);
  crop.height = std::min(whole.height, side > 0 ? side : crop_height);
  crop.grid_x = crop.grid_y = 8;
  return crop;
}

Values crop_planes(const Shape& whole, const Shape& crop, const float* from, int planes) {
  const int left = (whole.width - crop.width) / 2, top = (whole.height - crop.height) / 2;
  Values to;
  for (int p = 0; p < planes; ++p) {
    for (int y = 0; y < crop.height; ++y) {
      const float* row =
          from + whole.pixels() * p + static_cast<long>(top + y) * whole.width + left;
      to.insert(to.end(), row, row + crop.width);
    }
  }
  return to;
}

// A parameter array: its values, the gradient by the adjoint, and the step for differences.
struct Parameters {
  lang::ImageParam input;
  std::vector<int> sizes;
  bool moves;
  double step;
  Values values = {}, gradient = {};

  lang::Buffer<double> buffer(Values& of) const { return lang::Buffer<double>(of.data(), sizes); }
};

// The point where the gradient is checked: element `n` of each array, without the added noise. It is not the identity.
double start_of_grid(const Shape& shape, size_t n) {
  const size_t i = n % shape.coefficients(), o = n / shape.coefficients() % shape.channels;
  return i == o ? 1.0 : 0.0;
}
double start_of_mix(const Shape& shape, size_t n) {
  return n < static_cast<size_t>(shape.channels) ? 0.9 / shape.channels : 0.05;
}
double start_of_curve(size_t n) { return n == 0 ? 0.9 : 0.0; }

class Checker {
 public:
  Checker(const Shape& shape, const Groups& moves, Values photo, Values target)
      : shape_(shape),
        model_(shape, lang::Float(64)),
        adjoints_(model_.adjoints(moves)),
        photo_(std::move(photo)),
        target_(std::move(target)),
        grid_{model_.grid,
              {shape.coefficients(), shape.channels, shape.grid_z, shape.grid_x, shape.grid_y},
              moves.grid,
              grid_step},
        mix_{model_.mix, {shape.coefficients()}, moves.mix, guide_step},
        curve_{model_.curve, {shape.knots}, moves.curve, guide_step} {
    std::vector<lang::Func> outputs{model_.loss};
    if (moves.grid) outputs.push_back(adjoints_(model_.affine));
    if (moves.mix) outputs.push_back(adjoints_(model_.mixture));
    if (moves.curve) outputs.push_back(adjoints_(model_.slopes));
    gradient_ = lang::Pipeline(outputs);
    loss_ = lang::Pipeline({model_.loss});
    schedule();
    start();
  }

  GradientCheck run() {
    evaluate_gradient();
    for (Parameters* p : all_) compare(*p);
    return found_;
  }

 private:
  using Buffer = lang::Buffer<double>;

  // A plain schedule: the check tests the mathematics, on few pixels.
  void schedule() {
    for (lang::Func f :
         {model_.row_mixture, model_.row_slopes, model_.light, model_.guide, model_.depth,
          model_.row_grid, model_.plane, model_.result, model_.row_loss}) {
      f.compute_root();
      if (adjoints_.has(f)) adjoints_(f).compute_root();
    }
  }

  void start() {
    std::uniform_real_distribution<double> noise(-0.1, 0.1);
    const auto fill = [&](Parameters& p, auto&& base) {
      size_t size = 1;
      for (const int extent : p.sizes) size *= static_cast<size_t>(extent);
      p.gradient.assign(size, 0.0);
      for (size_t n = 0; n < size; ++n) p.values.push_back(base(n) + noise(random_));
    };
    fill(grid_, [&](size_t n) { return start_of_grid(shape_, n); });
    fill(mix_, [&](size_t n) { return start_of_mix(shape_, n); });
    fill(curve_, start_of_curve);
  }

  void bind() {
    model_.photo.set(Buffer(photo_.data(), shape_.width, shape_.height, shape_.coefficients()));
    model_.target.set(Buffer(target_.data(), shape_.width, shape_.height, shape_.channels));
    for (Parameters* p : all_) p->input.set(p->buffer(p->values));
  }

  void evaluate_gradient() {
    bind();
    Buffer loss = Buffer::make_scalar();
    std::vector<lang::Buffer<>> outputs{loss};
    for (Parameters* p : all_) {
      if (p->moves) outputs.push_back(p->buffer(p->gradient));
    }
    gradient_.realize(lang::Realization(outputs));
  }

  double evaluate_loss() {
    bind();
    Buffer loss = Buffer::make_scalar();
    std::vector<lang::Buffer<>> outputs{loss};
    loss_.realize(lang::Realization(outputs));
    return loss();
  }

  double central_difference(Parameters& p, const Values& direction) {
    const Values kept = p.values;
    const auto loss_at = [&](double step) {
      for (size_t n = 0; n < kept.size(); ++n) p.values[n] = kept[n] + step * direction[n];
      return evaluate_loss();
    };
    const double difference = (loss_at(p.step) - loss_at(-p.step)) / (2 * p.step);
    p.values = kept;
    return difference;
  }

  void compare_along(Parameters& p, const Values& direction, double smallest) {
    const double adjoint =
        std::inner_product(direction.begin(), direction.end(), p.gradient.begin(), 0.0);
    const double difference = central_difference(p, direction);
    const double scale = std::max({std::abs(adjoint), std::abs(difference), smallest});
    const double error = scale > 0 ? std::abs(adjoint - difference) / scale : 0.0;
    // Not std::max: a NaN must win and stay.
    double& worst = found_.max_relative_error;
    if (!std::isnan(worst) && !(error <= worst)) worst = error;
    ++found_.compared;
  }

  void compare(Parameters& p) {
    const size_t size = p.values.size();
    // Drawn also for groups that do not move, so that each group is always checked along the same directions.
    std::normal_distribution<double> normal;
    std::vector<Values> random_directions(directions, Values(size));
    for (Values& direction : random_directions) {
      for (double& value : direction) value = normal(random_);
    }
    if (!p.moves) return;
    std::vector<size_t> order(size);
    std::iota(order.begin(), order.end(), size_t{0});
    const size_t largest = std::min<size_t>(size, single_parameters);
    std::partial_sort(order.begin(), order.begin() + largest, order.end(), [&](size_t a, size_t b) {
      return std::abs(p.gradient[a]) > std::abs(p.gradient[b]);
    });
    // Differences for gradients this small are rounding errors of the loss.
    const double smallest = 1e-4 * std::abs(p.gradient[order[0]]);
    for (size_t n = 0; n < largest; ++n) {
      Values unit(size, 0.0);
      unit[order[n]] = 1.0;
      compare_along(p, unit, smallest);
    }
    for (const Values& direction : random_directions) compare_along(p, direction, smallest);
  }

  Shape shape_;
  Model model_;
  lang::Derivative adjoints_;
  lang::Pipeline gradient_, loss_;
  Values photo_, target_;
  Parameters grid_, mix_, curve_;
  const std::array<Parameters*, 3> all_{&grid_, &mix_, &curve_};
  std::mt19937 random_{20};
  GradientCheck found_;
};

}  // namespace

retrograde::GradientReport check_gradients_in_full(const Shape& shape, const float* photo,
                                                   const float* target,
                                                   const CheckOptions& options) {
  const Shape crop = crop_shape(shape, options.side);
  Model model(crop, lang::Float(32));
  std::mt19937 random(20);
  std::uniform_real_distribution<float> noise(-0.1f, 0.1f);
  const auto bound = [&](lang::ImageParam& to, const std::vector<int>& sizes, auto&& base) {
    lang::Buffer<float> buffer(sizes);
    size_t n = 0;
    buffer.for_each_value([&](float& value) { value = base(n++); });
    to.set(buffer);
  };
  const auto near = [&](double base) { return static_cast<float>(base) + noise(random); };
  const auto image = [&](lang::ImageParam& to, const float* from, int planes) {
    const Values values = crop_planes(shape, crop, from, planes);
    bound(to, {crop.width, crop.height, planes},
          [&](size_t n) { return static_cast<float>(values[n]); });
  };
  image(model.photo, photo, crop.coefficients());
  image(model.target, target, crop.channels);
  bound(model.grid, {crop.coefficients(), crop.channels, crop.grid_z, crop.grid_x, crop.grid_y},
        [&](size_t n) { return near(start_of_grid(crop, n)); });
  bound(model.mix, {crop.coefficients()}, [&](size_t n) { return near(start_of_mix(crop, n)); });
  bound(model.curve, {crop.knots}, [&](size_t n) { return near(start_of_curve(n)); });
  std::vector<lang::AdjointInput> by;
  if (options.moves.grid) by.emplace_back(model.grid);
  if (options.moves.mix) by.emplace_back(model.mix);
  if (options.moves.curve) by.emplace_back(model.curve);
  return retrograde::check_gradients(model.loss, {}, {.wrt = by});
}

GradientCheck check_gradient(const Shape& shape, const float* photo, const float* target,
                             const CheckOptions& options) {
  const Shape crop = crop_shape(shape, options.side);
  Checker checker(crop, options.moves, crop_planes(shape, crop, photo, crop.coefficients()),
                  crop_planes(shape, crop, target, crop.channels));
  return checker.run();
}

}  // namespace bilateral_slice
