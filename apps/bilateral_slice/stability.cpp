// stability.cpp -- see stability.h.
#include "stability.h"

#include <cmath>
#include <functional>

#include "model.h"

namespace bilateral_slice {

namespace {

// Small, so that a case takes milliseconds: 6 x 6 x 8 nodes.
constexpr Shape stability_shape{.width = 60, .height = 48, .grid_x = 6, .grid_y = 6};
constexpr int stability_steps = 40;
constexpr double large_rate = 3;

// The model in one precision, as a function of one vector of all parameters.
template <typename T>
class FlatModel {
 public:
  FlatModel() : model_(stability_shape, lang::type_of<T>()) {
    const lang::Derivative adjoints = model_.adjoints({});
    pipeline_ = lang::Pipeline(
        {model_.loss, adjoints(model_.affine), adjoints(model_.mixture), adjoints(model_.slopes)});
  }

  void set_images(const std::vector<double>& photo, const std::vector<double>& target) {
    model_.photo.set(filled({stability_shape.width, stability_shape.height, 4}, photo.begin()));
    model_.target.set(filled({stability_shape.width, stability_shape.height, 3}, target.begin()));
  }

  double loss(std::span<const double> x, std::span<double> gradient) {
    auto at = x.begin();
    std::vector<lang::Buffer<T>> outputs{lang::Buffer<T>::make_scalar()};
    for (const auto& [to, sizes] : parameters()) {
      to->set(filled(sizes, at));
      at += static_cast<long>(lang::Buffer<T>(sizes).number_of_elements());
      outputs.emplace_back(sizes);
    }
    pipeline_.realize(
        lang::Realization(std::vector<lang::Buffer<>>(outputs.begin(), outputs.end())));
    if (!gradient.empty()) {
      auto to = gradient.begin();
      for (size_t n = 1; n < outputs.size(); ++n)
        to = std::copy(outputs[n].begin(), outputs[n].end(), to);
    }
    return static_cast<double>(outputs[0]());
  }

 private:
  std::vector<std::pair<lang::ImageParam*, std::vector<int>>> parameters() {
    const Shape& s = stability_shape;
    return {{&model_.grid, {4, 3, s.grid_z, s.grid_x, s.grid_y}},
            {&model_.mix, {4}},
            {&model_.curve, {s.knots}}};
  }
  template <typename At>
  static lang::Buffer<T> filled(const std::vector<int>& sizes, At from) {
    lang::Buffer<T> buffer(sizes);
    for (T& value : buffer) value = static_cast<T>(*from++);
    return buffer;
  }

  Model model_;
  lang::Pipeline pipeline_;
};

// The identity look, with the mean of the colours as guide: Trainer's initial parameters.
std::vector<double> identity() {
  const Shape& s = stability_shape;
  std::vector<double> x(static_cast<size_t>(s.grid_elems()) + 4 + s.knots, 0.0);
  for (long n = 0; n < s.grid_elems(); ++n) x[n] = n % 4 == n / 4 % 3 ? 1 : 0;
  for (int n = 0; n < 3; ++n) x[s.grid_elems() + n] = 1.0 / 3;
  x[s.grid_elems() + 4] = 1;
  return x;
}

struct PhotoCase {
  const char* name;
  std::function<double(int x, int y)> value;
};

// Photos whose guide fills one layer, or two, or lies beyond the last.
const std::vector<PhotoCase>& photo_cases() {
  static const std::vector<PhotoCase> cases{
      {"a photograph's range",
       [](int x, int y) { return 0.5 + 0.4 * std::sin(0.3 * x) * std::cos(0.2 * y); }},
      {"one gray: all other cells are empty", [](int, int) { return 0.5; }},
      {"black", [](int, int) { return 0.0; }},
      {"saturated", [](int, int) { return 1.0; }},
      {"beyond the guide's range, 1000", [](int, int) { return 1e3; }},
      {"one bright pixel", [](int x, int y) { return x == 7 && y == 5 ? 1.0 : 0.0; }},
      {"1e-30", [](int, int) { return 1e-30; }}};
  return cases;
}

}  // namespace

std::vector<apps::StabilityRow> check_stability() {
  FlatModel<float> own;
  FlatModel<double> exact;
  const std::vector<double> x = identity();
  const apps::Problem problem{
      .size = x.size(), .evaluate = [&](auto at, auto gradient) { return own.loss(at, gradient); }};
  std::vector<apps::StabilityRow> rows;
  for (const PhotoCase& one : photo_cases()) {
    const long pixels = stability_shape.pixels();
    std::vector<double> photo(4 * pixels, 1.0), target(3 * pixels);
    for (long n = 0; n < 3 * pixels; ++n) {
      const int at = static_cast<int>(n % pixels);
      // Rounded to float32, so that both precisions get the same input.
      photo[n] =
          static_cast<float>(one.value(at % stability_shape.width, at / stability_shape.width));
      target[n] = static_cast<float>(0.8 * photo[n] + 0.1);
    }
    own.set_images(photo, target);
    exact.set_images(photo, target);
    std::vector<double> g(x.size()), g_exact(x.size());
    const double loss = own.loss(x, g), loss_exact = exact.loss(x, g_exact);
    apps::StabilityRow row{one.name, apps::relative_error({&loss, 1}, {&loss_exact, 1}),
                           apps::relative_error(g, g_exact)};
    apps::measure_divergence(row, problem, x, apps::large_steps(stability_steps, large_rate, 100));
    rows.push_back(row);
  }
  return rows;
}

}  // namespace bilateral_slice
