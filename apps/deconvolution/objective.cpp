// objective.cpp -- see objective.h.
#include "objective.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>

#include "demosaic/demosaicker.h"

namespace deconvolution {

using lang::Buffer;
using lang::Expr;
using lang::Func;

namespace {

// About the error of a photograph. Pieces then count by their errors, as the photograph's pixels do, but the worst
// pieces count less than that.
constexpr double usual_error = 2e-3;

std::vector<int> full_sizes(const Extent& e) { return {e.full_width(), e.full_height(), e.count}; }

}  // namespace

template <typename T>
Objective<T>::Objective(const Shape& shape, const Extent& extent, int threads,
                        std::vector<Array> arrays)
    : extent_(extent),
      arrays_(std::move(arrays)),
      solver_(shape, extent, threads),
      stage_(shape, extent, lang::type_of<T>()),
      lambda_(lang::type_of<T>(), 3, "lambda"),
      truth_(lang::type_of<T>(), 3, "truth"),
      result_(lang::type_of<T>(), 3, "result") {
  const auto begin = std::chrono::steady_clock::now();
  compile_loss(threads);
  compile_slope(threads);
  compile_seconds_ =
      solver_.compile_seconds() +
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

template <typename T>
void Objective<T>::compile_loss(int threads) {
  const auto number = [](double value) { return lang::cast(lang::type_of<T>(), Expr(value)); };
  const Extent& e = extent_;
  const lang::Var x("x"), y("y"), n("n");
  Func error("error"), sum("sum"), loss("loss");
  error(x, y, n) = result_(x + e.margin(), y + e.margin(), n) - truth_(x, y, n);
  const lang::RDom seen(0, e.width, 0, e.height, "seen"), each(0, e.count, "each");
  sum(n) = number(0);
  sum(n) += error(seen.x, seen.y, n) * error(seen.x, seen.y, n);
  const Expr mean = sum(each) * number(1.0 / (static_cast<double>(e.width) * e.height));
  loss() = number(0);
  loss() += number(10 / std::numbers::ln10 / e.count) * lang::log(mean + number(usual_error));
  const auto adjoints = lang::propagate_adjoints(loss, {.wrt = {result_}});
  loss_ = lang::Pipeline({loss, adjoints(result_)});
  demosaic::schedule_and_compile(loss_, threads);
}

template <typename T>
void Objective<T>::compile_slope(int threads) {
  const lang::Var x("x"), y("y"), n("n");
  Func direction("direction");
  direction(x, y, n) = lambda_(x, y, n);
  const Func slope =
      lang::propagate_tangents(stage_.energy, {{stage_.image, direction}})(stage_.energy);
  lang::AdjointOptions options{.wrt = {stage_.before}};
  for (const Array array : arrays_) options.wrt.emplace_back(stage_.of(array));
  adjoints_ = std::make_unique<lang::Derivative>(lang::propagate_adjoints(slope, options));
  std::vector<Func> outputs{(*adjoints_)(stage_.before)};
  for (const Array array : arrays_) outputs.push_back((*adjoints_)(stage_.of(array)));
  slope_ = lang::Pipeline(outputs);
  demosaic::schedule_and_compile(slope_, threads);
}

template <typename T>
size_t Objective<T>::stages() const {
  const auto funcs = adjoints_->funcs();
  return static_cast<size_t>(
      std::count_if(funcs.begin(), funcs.end(), [](const Func& f) { return f.defined(); }));
}

template <typename T>
void Objective<T>::set(const Simulated& batch) {
  solver_.set(batch.problem);
  bind_problem<T>(stage_, batch.problem);
  first_ = padded<T>(batch.problem);
  truth_.set(filled<T>({extent_.width, extent_.height, extent_.count},
                       std::span<const float>(batch.truth)));
}

template <typename T>
double Objective<T>::loss_and_gradient(const Image& image, Image& gradient) {
  result_.set(filled<T>(full_sizes(extent_), std::span<const T>(image)));
  Buffer<T> loss = Buffer<T>::make_scalar(), by_image(full_sizes(extent_));
  loss_.realize(lang::Realization(std::vector<Buffer<>>{loss, by_image}));
  gradient.assign(by_image.begin(), by_image.end());
  return static_cast<double>(loss());
}

template <typename T>
typename Objective<T>::Image Objective<T>::back_through(const Image& image, const Image& before,
                                                        const Image& lambda,
                                                        std::span<T> gradient) {
  const auto sizes = full_sizes(extent_);
  stage_.image.set(filled<T>(sizes, std::span<const T>(image)));
  stage_.before.set(filled<T>(sizes, std::span<const T>(before)));
  lambda_.set(filled<T>(sizes, std::span<const T>(lambda)));
  Buffer<T> by_before(sizes);
  std::vector<Buffer<>> outputs{by_before};
  for (const Array array : all_arrays) {
    if (std::find(arrays_.begin(), arrays_.end(), array) != arrays_.end())
      outputs.push_back(Buffer<T>(gradient.data(), sizes_of(stage_.shape, array)));
    gradient = gradient.subspan(elements_of(stage_.shape, array));
  }
  slope_.realize(lang::Realization(outputs));
  return {by_before.begin(), by_before.end()};
}

template <typename T>
double Objective<T>::evaluate(std::span<const T> numbers, std::span<T> gradient,
                              const Range& learned) {
  const size_t each = elements_of(stage_.shape);
  images_.assign(1, first_);
  for (int k = 0; k <= learned.last; ++k) {
    solver_.set(numbers.subspan(static_cast<size_t>(k) * each, each));
    images_.push_back(solver_.solve(images_.back(), accuracy_));
  }
  Image by_image;
  const double loss = loss_and_gradient(images_.back(), by_image);
  std::fill(gradient.begin(), gradient.end(), T(0));
  if (gradient.empty()) return loss;
  for (int k = learned.last; k >= learned.first; --k) {
    const auto from = static_cast<size_t>(k);
    for (T& value : by_image) value = -value;
    solver_.set(numbers.subspan(from * each, each));
    bind_numbers<T>(stage_, numbers.subspan(from * each, each));
    const Image lambda = solver_.solve_linear(by_image, accuracy_);
    by_image =
        back_through(images_[from + 1], images_[from], lambda, gradient.subspan(from * each, each));
  }
  return loss;
}

template class Objective<float>;
template class Objective<double>;

}  // namespace deconvolution
