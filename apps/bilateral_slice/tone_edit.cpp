// tone_edit.cpp -- see tone_edit.h.
#include "tone_edit.h"

#include <algorithm>
#include <string>

#include "language.h"

namespace bilateral_slice {

using lang::Expr;
using lang::Func;
using lang::RDom;
using lang::Var;

namespace {

constexpr float darkest = 0.01f;        // added to luminance before the logarithm
constexpr float edge_variance = 0.25f;  // of log luminance: larger variance means an edge
constexpr float key = -0.45f;           // log luminance towards which the base is pulled
constexpr float base_contrast = 0.4f;
constexpr float detail_contrast = 1.5f;
constexpr float saturation = 1.15f;

const Var x("x"), y("y"), c("c");

int radius(const Shape& shape) {
  return std::clamp(std::min(shape.width, shape.height) / 24, 2, 64);
}

Func luminance(const lang::ImageParam& photo, const Shape& shape) {
  Func f("luminance");
  if (shape.channels == 1) {
    f(x, y) = photo(x, y, 0);
    return f;
  }
  f(x, y) = 0.2126f * photo(x, y, 0) + 0.7152f * photo(x, y, 1) + 0.0722f * photo(x, y, 2);
  return f;
}

constexpr auto guarded_tail = lang::TailStrategy::GuardWithIf;  // never reads outside the photo

void store(Func f) { f.compute_root().vectorize(x, 8, guarded_tail).parallel(y); }

// Mean over a square, one axis at a time.
Func box_mean(const Func& f, int radius, const std::string& name) {
  const RDom r(-radius, 2 * radius + 1, "r");
  Func along_x(name + "_x"), mean(name);
  along_x(x, y) = lang::sum(f(x + r, y));
  mean(x, y) = lang::sum(along_x(x, y + r)) *
               (1.0f / static_cast<float>((2 * radius + 1) * (2 * radius + 1)));
  store(along_x);
  store(mean);
  return mean;
}

// The base layer of `f`: smooth, but with strong edges preserved.
Func guided_base(const Func& f, const Shape& shape) {
  const Func whole =
      lang::BoundaryConditions::repeat_edge(f, {{0, shape.width}, {0, shape.height}});
  Func squared("squared"), slope("slope"), offset("offset"), base("base");
  squared(x, y) = whole(x, y) * whole(x, y);
  const Func mean = box_mean(whole, radius(shape), "mean");
  const Func mean_square = box_mean(squared, radius(shape), "mean_square");
  const Expr variance = lang::max(mean_square(x, y) - mean(x, y) * mean(x, y), 0.0f);
  slope(x, y) = variance / (variance + edge_variance);
  offset(x, y) = mean(x, y) * (1.0f - slope(x, y));
  const Func mean_slope = box_mean(slope, radius(shape), "mean_slope");
  const Func mean_offset = box_mean(offset, radius(shape), "mean_offset");
  base(x, y) = mean_slope(x, y) * f(x, y) + mean_offset(x, y);
  return base;
}

}  // namespace

void tone_edit(const Shape& shape, float* photo, float* edited) {
  lang::ImageParam input(lang::Float(32), 3, "photo");
  const Func light = luminance(input, shape);
  Func tone("tone"), look("look"), out("edited");
  tone(x, y) = lang::log(light(x, y) + darkest);
  store(tone);
  const Func base = guided_base(tone, shape);
  const Expr detail = tone(x, y) - base(x, y);
  look(x, y) = lang::exp(key + base_contrast * (base(x, y) - key) + detail_contrast * detail);
  store(look);
  const Expr gain = look(x, y) / (light(x, y) + darkest);
  const Expr colour = input(x, y, c) * gain;
  const Expr gray = light(x, y) * gain;
  const Expr edited_sample =
      shape.channels == 1 ? colour : gray + saturation * (colour - gray);  // gray has no saturation
  out(x, y, c) = lang::clamp(edited_sample, 0.0f, 1.0f);
  out.vectorize(x, 8, guarded_tail).parallel(y);

  input.set(lang::Buffer<float>(photo, shape.width, shape.height, shape.coefficients()));
  lang::Buffer<float> result(edited, shape.width, shape.height, shape.channels);
  out.realize(result);
}

}  // namespace bilateral_slice
