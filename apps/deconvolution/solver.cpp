// solver.cpp -- see solver.h.
#include "solver.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "demosaic/demosaicker.h"

namespace deconvolution {

using lang::Buffer;
using lang::Expr;
using lang::Func;

namespace {

// A quotient of sums, in the images' type; 0 if the divisor is not positive.
Expr quotient(lang::Type scalar, const Expr& a, const Expr& b) {
  return lang::cast(scalar, lang::select(b > 0.0, a / lang::select(b > 0.0, b, Expr(1.0)), 0.0));
}

double largest(const Buffer<double>& values) {
  return *std::max_element(values.begin(), values.end());
}

}  // namespace

template <typename T>
void bind_problem(Stage& stage, const Problem& problem) {
  const Extent& e = problem.extent;
  const std::span<const float> blurred(problem.blurred), psfs(problem.psfs);
  stage.blurred.set(filled<T>({e.width, e.height, e.count}, blurred));
  stage.psf.set(filled<T>({e.psf, e.psf, e.count}, psfs));
  Buffer<T> noise(e.count);
  for (int k = 0; k < e.count; ++k) {
    const double deviation = problem.noises[static_cast<size_t>(k)] / usual_noise;
    noise(k) = static_cast<T>(deviation * deviation);
  }
  stage.noise.set(noise);
}

template <typename T>
void bind_numbers(Stage& stage, std::span<const T> numbers) {
  for (const Array array : all_arrays) {
    const size_t count = elements_of(stage.shape, array);
    stage.of(array).set(filled<T>(sizes_of(stage.shape, array), numbers.first(count)));
    numbers = numbers.subspan(count);
  }
}

template <typename T>
Solver<T>::Solver(const Shape& shape, const Extent& extent, int threads)
    : stage_(shape, extent, lang::type_of<T>()),
      x_(lang::type_of<T>(), 3, "cg_x"),
      r_(lang::type_of<T>(), 3, "cg_r"),
      p_(lang::type_of<T>(), 3, "cg_p"),
      square_(lang::Float(64), 1, "cg_square") {
  const auto begin = std::chrono::steady_clock::now();
  compile_start(threads);
  compile_step(threads);
  compile_seconds_ =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

template <typename T>
Func Solver<T>::sum_of_products(const Func& a, const Func& b, const char* name) const {
  const Extent& e = stage_.extent;
  const lang::RDom all(0, e.full_width(), 0, e.full_height(), "all");
  const lang::Var n("n");
  Func sum(name);
  sum(n) = 0.0;
  sum(n) += lang::cast<double>(a(all.x, all.y, n)) * lang::cast<double>(b(all.x, all.y, n));
  return sum;
}

template <typename T>
void Solver<T>::compile_start(int threads) {
  const auto adjoints = lang::propagate_adjoints(stage_.energy, {.wrt = {stage_.image}});
  const lang::Var x("x"), y("y"), n("n");
  Func residual("residual");
  residual(x, y, n) = -adjoints(stage_.image)(x, y, n);
  start_ = lang::Pipeline({residual, sum_of_products(residual, residual, "square")});
  demosaic::schedule_and_compile(start_, threads);
}

template <typename T>
void Solver<T>::compile_step(int threads) {
  const lang::Var x("x"), y("y"), n("n");
  Func direction("direction"), length("length"), ratio("ratio");
  direction(x, y, n) = p_(x, y, n);
  const Func product =
      lang::hessian_vector_product(stage_.energy, stage_.image, {{stage_.image, direction}});
  const Func curvature = sum_of_products(direction, product, "curvature");
  length(n) = quotient(stage_.scalar, square_(n), curvature(n));
  Func image("next_x"), residual("next_r"), next("next_p");
  image(x, y, n) = x_(x, y, n) + length(n) * p_(x, y, n);
  residual(x, y, n) = r_(x, y, n) - length(n) * product(x, y, n);
  const Func square = sum_of_products(residual, residual, "next_square");
  ratio(n) = quotient(stage_.scalar, square(n), square_(n));
  next(x, y, n) = residual(x, y, n) + ratio(n) * p_(x, y, n);
  step_ = lang::Pipeline({image, residual, next, square});
  demosaic::schedule_and_compile(step_, threads);
}

template <typename T>
std::vector<int> Solver<T>::sizes() const {
  const Extent& e = stage_.extent;
  return {e.full_width(), e.full_height(), e.count};
}

template <typename T>
typename Solver<T>::Vectors Solver<T>::vectors() const {
  return {Buffer<T>(sizes()), Buffer<T>(sizes()), Buffer<T>(sizes()),
          Buffer<double>(stage_.extent.count)};
}

template <typename T>
typename Solver<T>::Image Solver<T>::solve(const Image& before, const Accuracy& accuracy,
                                           const Watch& watch) {
  Vectors at = vectors();
  std::copy(before.begin(), before.end(), at.x.begin());
  stage_.image.set(at.x);
  stage_.before.set(at.x);
  start_.realize(lang::Realization(std::vector<Buffer<>>{at.r, at.square}));
  return iterate(std::move(at), accuracy, watch);
}

template <typename T>
typename Solver<T>::Image Solver<T>::solve_linear(const Image& right_side,
                                                  const Accuracy& accuracy) {
  Vectors at = vectors();
  at.x.fill(T(0));
  at.square.fill(0.0);
  const size_t each = right_side.size() / static_cast<size_t>(stage_.extent.count);
  for (size_t k = 0; k < right_side.size(); ++k) {
    at.square(static_cast<int>(k / each)) += static_cast<double>(right_side[k]) * right_side[k];
  }
  std::copy(right_side.begin(), right_side.end(), at.r.begin());
  return iterate(std::move(at), accuracy);
}

template <typename T>
typename Solver<T>::Image Solver<T>::iterate(Vectors at, const Accuracy& accuracy,
                                             const Watch& watch) {
  std::copy(at.r.begin(), at.r.end(), at.p.begin());
  Vectors next = vectors();
  const double limit = accuracy.tolerance * accuracy.tolerance;
  const std::vector<double> first(at.square.begin(), at.square.end());
  iterations_ = 0;
  const auto left = [&] {
    double worst = 0;
    for (size_t k = 0; k < first.size(); ++k) {
      if (first[k] > 0) worst = std::max(worst, at.square(static_cast<int>(k)) / first[k]);
    }
    return worst;
  };
  while ((!watch || watch(at.x)) && iterations_ < accuracy.iterations && largest(at.square) > 0 &&
         left() > limit) {
    x_.set(at.x);
    r_.set(at.r);
    p_.set(at.p);
    square_.set(at.square);
    step_.realize(lang::Realization(std::vector<Buffer<>>{next.x, next.r, next.p, next.square}));
    std::swap(at, next);
    ++iterations_;
  }
  reduction_ = std::sqrt(left());
  return {at.x.begin(), at.x.end()};
}

template <typename T>
double Solver<T>::energy(const Image& image, const Image& before) {
  stage_.image.set(filled<T>(sizes(), std::span<const T>(image)));
  stage_.before.set(filled<T>(sizes(), std::span<const T>(before)));
  const Buffer<T> value = stage_.energy.realize();
  return static_cast<double>(value());
}

template <typename T>
std::vector<T> padded(const Problem& problem) {
  const Extent& e = problem.extent;
  std::vector<T> image;
  image.reserve(e.full_elems());
  for (int k = 0; k < e.count; ++k) {
    for (int row = 0; row < e.full_height(); ++row) {
      const int from = std::clamp(row - e.margin(), 0, e.height - 1) + k * e.height;
      for (int column = 0; column < e.full_width(); ++column) {
        const int at = std::clamp(column - e.margin(), 0, e.width - 1);
        image.push_back(static_cast<T>(
            problem.blurred[static_cast<size_t>(from) * static_cast<size_t>(e.width) +
                            static_cast<size_t>(at)]));
      }
    }
  }
  return image;
}

template <typename T>
std::vector<float> cropped(const std::vector<T>& image, const Extent& e) {
  std::vector<float> seen;
  seen.reserve(e.seen_elems());
  for (int k = 0; k < e.count; ++k) {
    for (int row = 0; row < e.height; ++row) {
      const size_t from = (static_cast<size_t>(k * e.full_height() + row + e.margin())) *
                              static_cast<size_t>(e.full_width()) +
                          static_cast<size_t>(e.margin());
      for (size_t column = 0; column < static_cast<size_t>(e.width); ++column) {
        seen.push_back(static_cast<float>(image[from + column]));
      }
    }
  }
  return seen;
}

template void bind_problem<float>(Stage&, const Problem&);
template void bind_problem<double>(Stage&, const Problem&);
template void bind_numbers<float>(Stage&, std::span<const float>);
template void bind_numbers<double>(Stage&, std::span<const double>);
template class Solver<float>;
template class Solver<double>;
template std::vector<float> padded<float>(const Problem&);
template std::vector<double> padded<double>(const Problem&);
template std::vector<float> cropped<float>(const std::vector<float>&, const Extent&);
template std::vector<float> cropped<double>(const std::vector<double>&, const Extent&);

}  // namespace deconvolution
