// gradient_check.cpp -- see gradient_check.h.
//
// The loss is quadratic in the grid, so its central difference is exact for any step. In the
// guide's parameters it has kinks (the hinges; a pixel that changes its layer): the step is so
// small that hardly a pixel crosses one, and still large against rounding in double.
#include "gradient_check.h"

#include <algorithm>
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

Shape crop_shape(const Shape& whole) {
  Shape crop = whole;
  crop.width = std::min(whole.width, crop_width);
  crop.height = std::min(whole.height, crop_height);
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

// A parameter array: its values, the gradient that the adjoint gave, and the step for differences.
struct Parameters {
  Values values;
  Values gradient;
  double step;
};

class Checker {
 public:
  Checker(const Shape& shape, Values photo, Values target)
      : shape_(shape),
        model_(shape, lang::Float(64)),
        adjoints_(lang::propagate_adjoints(model_.loss)),
        photo_(std::move(photo)),
        target_(std::move(target)) {
    gradient_ = lang::Pipeline({model_.loss, adjoints_(model_.affine), adjoints_(model_.mixture),
                                adjoints_(model_.slopes)});
    loss_ = lang::Pipeline({model_.loss});
    schedule();
    start();
  }

  GradientCheck run() {
    evaluate_gradient();
    for (Parameters* p : {&grid_, &mix_, &curve_}) compare(*p);
    return found_;
  }

 private:
  using Buffer = lang::Buffer<double>;

  // Plain and at root: what is checked is the mathematics, on few pixels.
  void schedule() {
    for (lang::Func f :
         {model_.row_mixture, model_.row_slopes, model_.light, model_.guide, model_.depth,
          model_.row_grid, model_.plane, model_.result, model_.row_loss}) {
      f.compute_root();
      lang::Func adjoint = adjoints_(f);
      if (adjoint.defined()) adjoint.compute_root();
    }
  }

  void start() {
    std::uniform_real_distribution<double> noise(-0.1, 0.1);
    const auto fill = [&](Parameters& p, size_t size, double step, auto&& base) {
      p = {Values(size), Values(size, 0.0), step};
      for (size_t n = 0; n < size; ++n) p.values[n] = base(n) + noise(random_);
    };
    fill(grid_, shape_.grid_elems(), grid_step,
         [](size_t n) { return n % 4 == n / 4 % 3 ? 1.0 : 0.0; });
    fill(mix_, 4, guide_step, [](size_t n) { return n < 3 ? 0.3 : 0.05; });
    fill(curve_, shape_.knots, guide_step, [](size_t n) { return n == 0 ? 0.9 : 0.0; });
  }

  Buffer grid_buffer(Values& v) {
    return Buffer(v.data(), std::vector<int>{4, 3, shape_.grid_z, shape_.grid_x, shape_.grid_y});
  }

  void bind() {
    model_.photo.set(Buffer(photo_.data(), shape_.width, shape_.height, 4));
    model_.target.set(Buffer(target_.data(), shape_.width, shape_.height, 3));
    model_.grid.set(grid_buffer(grid_.values));
    model_.mix.set(Buffer(mix_.values.data(), 4));
    model_.curve.set(Buffer(curve_.values.data(), shape_.knots));
  }

  void evaluate_gradient() {
    bind();
    Buffer loss = Buffer::make_scalar();
    std::vector<lang::Buffer<>> outputs{loss, grid_buffer(grid_.gradient),
                                        Buffer(mix_.gradient.data(), 4),
                                        Buffer(curve_.gradient.data(), shape_.knots)};
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
    // Not std::max: a NaN must win, and stay.
    double& worst = found_.max_relative_error;
    if (!std::isnan(worst) && !(error <= worst)) worst = error;
    ++found_.compared;
  }

  void compare(Parameters& p) {
    const size_t size = p.values.size();
    std::vector<size_t> order(size);
    std::iota(order.begin(), order.end(), size_t{0});
    const size_t largest = std::min<size_t>(size, single_parameters);
    std::partial_sort(order.begin(), order.begin() + largest, order.end(), [&](size_t a, size_t b) {
      return std::abs(p.gradient[a]) > std::abs(p.gradient[b]);
    });
    // Differences of a gradient this small are rounding errors of the loss.
    const double smallest = 1e-4 * std::abs(p.gradient[order[0]]);
    for (size_t n = 0; n < largest; ++n) {
      Values unit(size, 0.0);
      unit[order[n]] = 1.0;
      compare_along(p, unit, smallest);
    }
    std::normal_distribution<double> normal;
    for (int d = 0; d < directions; ++d) {
      Values direction(size);
      for (double& value : direction) value = normal(random_);
      compare_along(p, direction, smallest);
    }
  }

  Shape shape_;
  Model model_;
  lang::Derivative adjoints_;
  lang::Pipeline gradient_, loss_;
  Values photo_, target_;
  Parameters grid_, mix_, curve_;
  std::mt19937 random_{20};
  GradientCheck found_;
};

}  // namespace

retrograde::GradientReport check_gradients_in_full(const Shape& shape, const float* photo,
                                                   const float* target) {
  const Shape crop = crop_shape(shape);
  Model model(crop, lang::Float(32));
  std::mt19937 random(20);
  std::uniform_real_distribution<float> noise(-0.1f, 0.1f);
  const auto bound = [&](lang::ImageParam& to, const std::vector<int>& sizes, auto&& base) {
    lang::Buffer<float> buffer(sizes);
    size_t n = 0;
    buffer.for_each_value([&](float& value) { value = base(n++); });
    to.set(buffer);
  };
  const auto image = [&](lang::ImageParam& to, const float* from, int planes) {
    const Values values = crop_planes(shape, crop, from, planes);
    bound(to, {crop.width, crop.height, planes},
          [&](size_t n) { return static_cast<float>(values[n]); });
  };
  image(model.photo, photo, 4);
  image(model.target, target, 3);
  bound(model.grid, {4, 3, crop.grid_z, crop.grid_x, crop.grid_y},
        [&](size_t n) { return (n % 4 == n / 4 % 3 ? 1.0f : 0.0f) + noise(random); });
  bound(model.mix, {4}, [&](size_t n) { return (n < 3 ? 0.3f : 0.05f) + noise(random); });
  bound(model.curve, {crop.knots},
        [&](size_t n) { return (n == 0 ? 0.9f : 0.0f) + noise(random); });
  return retrograde::check_gradients(model.loss, {}, {.wrt = {model.grid, model.mix, model.curve}});
}

GradientCheck check_gradient(const Shape& shape, const float* photo, const float* target) {
  const Shape crop = crop_shape(shape);
  Checker checker(crop, crop_planes(shape, crop, photo, 4), crop_planes(shape, crop, target, 3));
  return checker.run();
}

}  // namespace bilateral_slice
