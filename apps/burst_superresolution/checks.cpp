// checks.cpp -- see checks.h.
#include "checks.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include "evaluator.h"
#include "fit.h"

namespace burst {

namespace {

constexpr int part_width = 24, part_height = 20, part_frames = 3;
Smoothness part_smoothness() {
  Smoothness smoothness;
  for (const auto& axis : axes_of(Colours::Opponent)) smoothness.push_back({axis, 1e-2});
  return smoothness;
}

// A point of the objective, and the frames to fit.
struct Case {
  std::string name;
  std::vector<float> picture;            // [3, height, width]
  std::vector<Homography> homographies;  // of each frame
  std::vector<float> samples;            // [frames, height, width]
};

class Numbers {
 public:
  explicit Numbers(uint64_t seed) : random_(seed) {}
  // In [-bound, bound].
  double within(double bound) {
    return bound * (static_cast<double>(random_() >> 11) * 0x1p-52 - 1);
  }

 private:
  std::mt19937_64 random_;
};

Shape part_shape(const Burst& burst) {
  const FrameSize size{std::min(part_width, burst.size.width),
                       std::min(part_height, burst.size.height)};
  return {size, part_frames};
}

// Samples from the middle of the first frames; the last frame is repeated if the burst has too few.
std::vector<float> part_samples(const Burst& burst, const Shape& shape) {
  const int left = (burst.size.width - shape.size.width) / 4 * 2;
  const int top = (burst.size.height - shape.size.height) / 4 * 2;
  std::vector<float> samples;
  for (int n = 0; n < shape.frames; ++n) {
    const auto frame = burst.frame(std::min(n, burst.frames() - 1));
    for (int y = top; y < top + shape.size.height; ++y) {
      const auto row = frame.begin() + static_cast<long>(y) * burst.size.width + left;
      samples.insert(samples.end(), row, row + shape.size.width);
    }
  }
  return samples;
}

// Positions between pixels, and a picture that is near the samples and nowhere constant.
Case ordinary(const Burst& burst, uint64_t seed) {
  const Shape shape = part_shape(burst);
  Numbers numbers(seed);
  Case result{"as given", {}, {Homography{}}, part_samples(burst, shape)};
  for (size_t n = 0; n < shape.image_elems(); ++n) {
    const double sample = result.samples[n % shape.size.pixels()];
    result.picture.push_back(static_cast<float>(sample + numbers.within(0.05)));
  }
  // Also for the first frame: with the identity, all its positions would be kinks.
  result.homographies.clear();
  for (int n = 0; n < shape.frames; ++n) {
    Homography h{};
    for (double& value : h) value = numbers.within(0.04);
    result.homographies.push_back(h);
  }
  return result;
}

template <typename T>
std::vector<T> numbers_of(const Case& at) {
  const std::vector<float> x = joined(at.picture, at.homographies);
  return {x.begin(), x.end()};
}

template <typename T>
lang::Buffer<T> filled(const std::vector<int>& sizes, std::span<const float> values) {
  lang::Buffer<T> buffer(sizes);
  std::copy(values.begin(), values.end(), buffer.begin());
  return buffer;
}

template <typename T>
void bind(Objective& objective, const Shape& shape, const Case& at) {
  const int width = shape.size.width, height = shape.size.height;
  const std::vector<float> x = joined(at.picture, at.homographies);
  const std::span<const float> all(x);
  objective.image.set(filled<T>({width, height, 3}, all.first(shape.image_elems())));
  objective.homographies.set(
      filled<T>({homography_params, shape.frames}, all.subspan(shape.image_elems())));
  std::vector<float> weights;
  for (const ColourAxis& axis : part_smoothness())
    weights.push_back(static_cast<float>(axis.weight));
  objective.weights.set(filled<T>({static_cast<int>(weights.size())}, weights));
  objective.frames.set(filled<T>({width, height, shape.frames}, at.samples));
}

// The frames predicted from the picture, minus the samples.
template <typename T>
std::vector<double> residuals(Objective& objective, const Shape& shape, const Case& at) {
  bind<T>(objective, shape, at);
  const lang::Buffer<T> out =
      objective.residual.realize({shape.size.width, shape.size.height, shape.frames});
  return {out.begin(), out.end()};
}

using Change = std::function<void(Case&, const Shape&)>;

Change moved(int parameter, double value) {
  return [=](Case& at, const Shape&) {
    for (Homography& h : at.homographies) h[static_cast<size_t>(parameter)] = value;
  };
}

Change level(float picture, float sample) {
  return [=](Case& at, const Shape&) {
    std::fill(at.picture.begin(), at.picture.end(), picture);
    std::fill(at.samples.begin(), at.samples.end(), sample);
  };
}

void make_identical(Case& at, const Shape& shape) {
  const size_t pixels = shape.size.pixels();
  for (size_t n = pixels; n < at.samples.size(); ++n) at.samples[n] = at.samples[n % pixels];
  std::fill(at.homographies.begin(), at.homographies.end(), Homography{});
}

void half_black(Case& at, const Shape& shape) {
  const auto width = static_cast<size_t>(shape.size.width);
  for (std::vector<float>* values : {&at.picture, &at.samples}) {
    for (size_t n = 0; n < values->size(); ++n) (*values)[n] = n % width < width / 2 ? 0.0f : 1.0f;
  }
}

const std::vector<std::pair<const char*, Change>>& hard_cases() {
  static const std::vector<std::pair<const char*, Change>> cases{
      {"as given", [](Case&, const Shape&) {}},
      {"identical frames, identities", make_identical},
      {"black frames", level(0, 0)},
      {"saturated frames", level(1, 1)},
      {"black picture, saturated frames", level(0, 1)},
      {"black beside saturated", half_black},
      {"frames of 1e-20", level(1e-20f, 2e-20f)},
      {"a homography onto a line, to 1e-6", moved(4, -1 + 1e-6)},
      {"onto a point, to 1e-6",
       [](Case& at, const Shape&) {
         for (Homography& h : at.homographies) h[0] = h[4] = -1 + 1e-6;
       }},
      {"horizon through the frames", moved(6, -1.3)},
      {"depth 0 at the frames' edge", moved(6, -1)},
      {"mirrored", moved(0, -2)},
      {"frames beyond the picture", moved(2, 5)},
      {"parameters of 1e6", moved(2, 1e6)}};
  return cases;
}

// The larger of the gradient errors by the picture and by the homographies, each relative to its largest element.
double gradient_error(const Shape& shape, const std::vector<float>& own,
                      const std::vector<double>& exact) {
  const std::vector<double> wide(own.begin(), own.end());
  const size_t image = shape.image_elems();
  const auto of = [&](size_t from, size_t count) {
    return apps::relative_error(std::span(wide).subspan(from, count),
                                std::span(exact).subspan(from, count));
  };
  const double by_image = of(0, image), by_motion = of(image, shape.motion_elems());
  return by_image > by_motion || std::isnan(by_image) ? by_image : by_motion;
}

apps::Problem problem_of(Evaluator<float>& evaluator) {
  apps::Problem problem{.size = evaluator.size()};
  problem.evaluate = [&](std::span<const double> x, std::span<double> gradient) {
    std::vector<float> at(x.begin(), x.end()), g(x.size());
    const double loss = evaluator.evaluate(at, g);
    if (!gradient.empty()) std::copy(g.begin(), g.end(), gradient.begin());
    return loss;
  };
  return problem;
}

}  // namespace

std::vector<apps::GradientRow> check_gradients(const Burst& burst, uint64_t seed) {
  const Shape shape = part_shape(burst);
  Objective objective(shape, part_smoothness());
  bind<float>(objective, shape, ordinary(burst, seed));
  return apps::gradient_rows(retrograde::check_gradients(
      objective.loss, {}, {.directions = 2, .wrt = {objective.image, objective.homographies}}));
}

std::vector<apps::StabilityRow> check_stability(const Burst& burst, uint64_t seed, int threads) {
  const Shape shape = part_shape(burst);
  Evaluator<float> in_float(shape, part_smoothness(), {}, threads);
  Evaluator<double> in_double(shape, part_smoothness(), {}, threads);
  Objective own(shape, part_smoothness()), exact(shape, part_smoothness(), lang::Float(64));
  const apps::Problem problem = problem_of(in_float);
  std::vector<apps::StabilityRow> rows;
  for (const auto& [name, change] : hard_cases()) {
    Case at = ordinary(burst, seed);
    change(at, shape);
    in_float.set_frames(at.samples);
    in_double.set_frames(at.samples);
    auto x = numbers_of<float>(at);
    auto wide_x = numbers_of<double>(at);
    std::vector<float> gradient(x.size());
    std::vector<double> wide_gradient(x.size());
    in_float.evaluate(x, gradient);
    in_double.evaluate(wide_x, wide_gradient);
    apps::StabilityRow row{
        name,
        apps::relative_error(residuals<float>(own, shape, at), residuals<double>(exact, shape, at)),
        gradient_error(shape, gradient, wide_gradient)};
    apps::measure_divergence(row, problem, wide_x, apps::large_steps(60, 0.3, 10));
    rows.push_back(row);
  }
  return rows;
}

}  // namespace burst
