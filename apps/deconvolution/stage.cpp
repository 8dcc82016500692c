// stage.cpp -- see stage.h.
#include "stage.h"

#include <cmath>

#include "cleaning.h"
#include "demosaic/relaxed.h"

namespace deconvolution {

using lang::Expr;
using lang::Func;
using lang::RDom;

namespace {

constexpr double finest_bump = 0.004;  // one step of 8-bit samples

std::vector<lang::ImageParam> parameters(const Shape& shape, lang::Type scalar) {
  constexpr std::array<const char*, all_arrays.size()> names{"filters", "log_weights", "shrinkage",
                                                             "smoothing"};
  std::vector<lang::ImageParam> result;
  for (const Array array : all_arrays) {
    const auto dimensions = static_cast<int>(sizes_of(shape, array).size());
    result.emplace_back(scalar, dimensions, names[static_cast<size_t>(array)]);
  }
  return result;
}

}  // namespace

double bump_width(int j) { return finest_bump * std::exp2(j); }

std::vector<int> sizes_of(const Shape& shape, Array array) {
  switch (array) {
    case Array::Filters:
      return {shape.size, shape.size, shape.filters};
    case Array::LogWeights:
      return {shape.filters};
    case Array::Shrinkage:
      return {1 + shape.bumps, shape.filters};
    case Array::Smoothing:
      return {smoothing_numbers};
  }
  return {};
}

size_t elements_of(const Shape& shape, Array array) {
  return demosaic::elements_of(sizes_of(shape, array));
}

size_t elements_of(const Shape& shape) {
  size_t sum = 0;
  for (const Array array : all_arrays) sum += elements_of(shape, array);
  return sum;
}

Stage::Stage(const Shape& shape, const Extent& extent, lang::Type scalar)
    : shape(shape),
      extent(extent),
      scalar(scalar),
      image(scalar, 3, "image"),
      before(scalar, 3, "before"),
      blurred(scalar, 3, "blurred"),
      psf(scalar, 3, "psf"),
      noise(scalar, 1, "noise"),
      arrays(parameters(shape, scalar)) {
  define_kernel();
  define_target();
  define_energy();
}

void Stage::define_kernel() {
  const RDom tap(0, shape.size, 0, shape.size, "tap");
  const lang::ImageParam& filters = of(Array::Filters);
  Func sum("kernel_sum");
  sum(f_) = number(0);
  sum(f_) += filters(tap.x, tap.y, f_);
  kernel(u_, v_, f_) = filters(u_, v_, f_) - sum(f_) * number(1.0 / (shape.size * shape.size));
}

// The filter response at positions where the filter lies within the image, indexed by the filter's first sample.
Func Stage::response(const Func& of, const std::string& name) const {
  const RDom tap(0, shape.size, 0, shape.size, "tap");
  Func result(name);
  result(x_, y_, f_, n_) = number(0);
  result(x_, y_, f_, n_) += kernel(tap.x, tap.y, f_) * of(x_ + tap.x, y_ + tap.y, n_);
  return result;
}

Expr Stage::shrunk(const Expr& d) const {
  const lang::ImageParam& numbers = arrays[static_cast<size_t>(Array::Shrinkage)];
  const Expr square = d * d;
  if (shape.bumps == 0) {
    const Expr t = numbers(0, f_) * numbers(0, f_), fourth = square * square;
    // Avoids a pole if derivative and threshold are both 0.
    return d * fourth / (fourth + t * t + number(1e-30));
  }
  Expr factor = numbers(0, f_);
  for (int j = 0; j < shape.bumps; ++j) {
    const double width = bump_width(j);
    factor += numbers(j + 1, f_) * lang::exp(square * number(-0.5 / (width * width)));
  }
  return d * factor;
}

void Stage::define_target() {
  Func seen("before_image");
  seen(x_, y_, n_) = before(x_, y_, n_);
  cleaned = clean(seen, of(Array::Smoothing), extent.full_width(), extent.full_height(), scalar);
  const Func derivative = response(cleaned, "derivative");
  target(x_, y_, f_, n_) = shrunk(derivative(x_, y_, f_, n_));
}

void Stage::define_energy() {
  const int side = extent.psf, width = extent.full_width(), height = extent.full_height();
  const RDom tap(0, side, 0, side, "psf_tap");
  Func sharp("sharp"), blur("blur"), residual("residual"), miss("miss");
  sharp(x_, y_, n_) = image(x_, y_, n_);
  blur(x_, y_, n_) = number(0);
  blur(x_, y_, n_) +=
      psf(tap.x, tap.y, n_) * sharp(x_ + (side - 1 - tap.x), y_ + (side - 1 - tap.y), n_);
  residual(x_, y_, n_) = blur(x_, y_, n_) - blurred(x_, y_, n_);
  const Func filtered = response(sharp, "filtered");
  miss(x_, y_, f_, n_) = filtered(x_, y_, f_, n_) - target(x_, y_, f_, n_);

  const RDom seen(0, extent.width, 0, extent.height, 0, extent.count, "seen");
  const int inner = shape.size - 1;
  const RDom all(0, width - inner, 0, height - inner, 0, shape.filters, 0, extent.count, "all");
  energy() = number(0);
  energy() += number(0.5) * residual(seen.x, seen.y, seen.z) * residual(seen.x, seen.y, seen.z);
  const Expr off = miss(all.x, all.y, all.z, all.w);
  energy() += number(0.5) * noise(all.w) * lang::exp(of(Array::LogWeights)(all.z)) * off * off;
}

}  // namespace deconvolution
