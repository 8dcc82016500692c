#include "relaxed.h"

#include <numeric>

#include "bayer.h"

namespace demosaic {

using lang::Expr;
using lang::Func;
using lang::RDom;

namespace {
// Samples lie in [0, 1]. With a learned scale of 1, a step of 1 / steepness has weight one half.
constexpr double steepness = 40;
// With this factor and weights of 1, scores differ by a few units if one candidate is rough.
constexpr double score_factor = 0.25;
constexpr int window = 3, chroma_window = 5, near_window = 3, directions = 4;
}  // namespace

std::vector<int> sizes_of(const Shape& shape, Array array) {
  switch (array) {
    case Array::Green:
      return {shape.size, shape.size, shape.filters, 2};
    case Array::Closeness:
      return {shape.filters, 3};
    case Array::Selection:
      return {window, window, 2, directions, shape.filters, 2};
    case Array::Cross:
      return {shape.filters, directions, shape.filters, 2};
    case Array::Bias:
      return {shape.filters, 2};
    case Array::Chroma:
      return {chroma_window, chroma_window, 2, lost_samples};
    case Array::Near:
      return {near_window, near_window, lost_samples};
    case Array::Steepness:
      return {lost_samples};
  }
  return {};
}

size_t elements_of(const std::vector<int>& sizes) {
  return std::accumulate(sizes.begin(), sizes.end(), size_t{1}, std::multiplies<>());
}

size_t elements_of(const Shape& shape, Array array) { return elements_of(sizes_of(shape, array)); }

Parameters::Parameters(const Shape& shape, lang::Type scalar) {
  constexpr std::array<const char*, all_arrays.size()> names{
      "green_weights", "closeness_weights", "selection_weights", "cross_weights",
      "bias_weights",  "chroma_weights",    "near_weights",      "steepness_weights"};
  for (Array array : all_arrays) {
    const auto dimensions = static_cast<int>(sizes_of(shape, array).size());
    arrays.emplace_back(scalar, dimensions, names[static_cast<size_t>(array)]);
  }
}

Relaxed::Relaxed(const Shape& shape, const Func& mosaic, const std::vector<lang::Var>& batch,
                 lang::Type scalar)
    : shape(shape), scalar(scalar), parameters(shape, scalar), mosaic(mosaic), batch(batch) {
  define_parameters();
  define_candidates();
  define_homogeneity();
  define_mixture();
  define_colour_differences();
  define_image();
}

int Relaxed::reach(const Shape& shape) {
  // In cells: the windows of the step to the median, of chroma and of selection, and the previous neighbour; then the
  // filter.
  const int cells = near_window / 2 + chroma_window / 2 + window / 2 + 1 + (shape.size / 2 + 1) / 2;
  return 2 * cells;
}

Relaxed::Exprs Relaxed::at(Exprs place) const {
  place.insert(place.end(), batch.begin(), batch.end());
  return place;
}

// A site is on the diagonal of its cell.
Expr Relaxed::own(const Expr& cell_x, const Expr& cell_y, const Expr& site) const {
  return mosaic(at({2 * cell_x + site, 2 * cell_y + site}));
}

void Relaxed::define_parameters() {
  const lang::Var u("u"), v("v"), p("p");
  filters(u, v, i, q) = parameters.of(Array::Green)(u, v, i, q);
  scales(i, p) = parameters.of(Array::Closeness)(i, p);
  windows(u, v, p, d, i, q) = parameters.of(Array::Selection)(u, v, p, d, i, q);
  crossings(u, d, i, q) = parameters.of(Array::Cross)(u, d, i, q);
  biases(i, q) = parameters.of(Array::Bias)(i, q);
  chroma(u, v, q, t) = parameters.of(Array::Chroma)(u, v, q, t);
  nearness(u, v, t) = parameters.of(Array::Near)(u, v, t);
  steepnesses(t) = parameters.of(Array::Steepness)(t);
}

void Relaxed::define_candidates() {
  const RDom r(0, shape.size, 0, shape.size, "tap");
  const int half = shape.size / 2;
  green(at({x, y, q, i})) = number(0);
  green(at({x, y, q, i})) +=
      filters(r.x, r.y, i, q) * mosaic(at({2 * x + q + r.x - half, 2 * y + q + r.y - half}));
}

void Relaxed::define_homogeneity() {
  const Expr here = green(at({x, y, q, i}));
  // The squared step to the previous site.
  const auto before = [&](int dx, int dy) {
    const Expr light = here - green(at({x - dx, y - dy, q, i}));
    const Expr ratio = light - (own(x, y, q) - own(x - dx, y - dy, q));
    const Expr a = scales(i, 0) * ratio, b = scales(i, 1) * light;
    return a * a + b * b;
  };
  const auto beside = [&](int dx, int dy) {
    const auto measured = [&](int sign) {
      return mosaic(at({2 * x + q + sign * dx, 2 * y + q + sign * dy}));
    };
    const Expr a = scales(i, 2) * (number(2) * here - measured(-1) - measured(1));
    return a * a;
  };
  const Expr step = lang::select(
      d == 0, before(1, 0),
      lang::select(d == 1, before(0, 1), lang::select(d == 2, beside(1, 0), beside(0, 1))));
  close(at({x, y, q, i, d})) = number(1) / (number(1) + number(steepness * steepness) * step);

  const RDom r(0, window, 0, window, 0, 2, "around");
  const int half = window / 2;
  seen(at({x, y, q, i, d})) = number(0);
  seen(at({x, y, q, i, d})) +=
      windows(r.x, r.y, r.z, d, i, q) * close(at({x + r.x - half, y + r.y - half, r.z, i, d}));
  const RDom of(0, shape.filters, 0, directions, "of");
  score(at({x, y, q, i})) = biases(i, q);
  score(at({x, y, q, i})) +=
      number(score_factor) * crossings(of.x, of.y, i, q) * seen(at({x, y, q, of.x, of.y}));
}

void Relaxed::define_mixture() {
  const RDom r(0, shape.filters, "candidate");
  top(at({x, y, q})) = score(at({x, y, q, 0}));
  top(at({x, y, q})) = lang::max(top(at({x, y, q})), score(at({x, y, q, r})));
  // A softmax does not change if the same value is subtracted from all its arguments, and neither do its gradients.
  share(at({x, y, q, i})) =
      lang::exp(score(at({x, y, q, i})) - lang::stop_gradient(top(at({x, y, q}))));
  const Expr part = share(at({x, y, q, r}));
  weighed(at({x, y, q})) = lang::Tuple(number(0), number(0));
  weighed(at({x, y, q})) = lang::Tuple(weighed(at({x, y, q}))[0] + part * green(at({x, y, q, r})),
                                       weighed(at({x, y, q}))[1] + part);
  mixed(at({x, y, q})) = weighed(at({x, y, q}))[0] / weighed(at({x, y, q}))[1];
}

void Relaxed::define_colour_differences() {
  const RDom r(0, chroma_window, 0, chroma_window, 0, 2, "around");
  const int half = chroma_window / 2;
  difference(at({x, y, q})) = mixed(at({x, y, q})) - own(x, y, q);
  rough(at({x, y, t})) = number(0);
  rough(at({x, y, t})) +=
      chroma(r.x, r.y, r.z, t) * difference(at({x + r.x - half, y + r.y - half, r.z}));

  // Red's missing samples use red sites, blue's use blue ones, and a missing green uses its own site.
  const Expr site = lang::select(t == 1 || t == 2 || t == 5 || t == 7, 1, 0);
  const RDom n(0, near_window, 0, near_window, "near");
  const Expr other = difference(at({x + n.x - near_window / 2, y + n.y - near_window / 2, site}));
  const Expr distance = number(steepness) * steepnesses(t) * (other - rough(at({x, y, t})));
  const Expr weight =
      nearness(n.x, n.y, t) * nearness(n.x, n.y, t) / (number(1) + distance * distance);
  pull(at({x, y, t})) = lang::Tuple(rough(at({x, y, t})), number(1));
  pull(at({x, y, t})) =
      lang::Tuple(pull(at({x, y, t}))[0] + weight * other, pull(at({x, y, t}))[1] + weight);
  smooth(at({x, y, t})) = pull(at({x, y, t}))[0] / pull(at({x, y, t}))[1];
}

void Relaxed::define_image() {
  const auto green_at_site = [&](const Expr& site) {
    return own(x, y, site) + smooth(at({x, y, site}));
  };
  const Expr green_there = lang::select(
      t < 4, green_at_site(lang::clamp(t - missing_greens, 0, 1)),
      lang::select(t < 6, mosaic(at({2 * x + 1, 2 * y})), mosaic(at({2 * x, 2 * y + 1}))));
  estimate(at({x, y, t})) = lang::select(t < missing_greens, green_at_site(lang::clamp(t, 0, 1)),
                                         green_there - smooth(at({x, y, t})));

  const auto lost = [&](int n) { return Expr(estimate(at({x / 2, y / 2, n}))); };
  const Expr measured = mosaic(at({x, y}));
  const Expr red = by_place(x, y, measured, lost(4), lost(6), lost(3));
  const Expr green_here = by_place(x, y, lost(0), measured, measured, lost(1));
  const Expr blue = by_place(x, y, lost(2), lost(5), lost(7), measured);
  image = Func("image");
  image(at({x, y, c})) = lang::select(c == 0, red, lang::select(c == 1, green_here, blue));
}

const Func& learned_func(const Relaxed& model, Array array) {
  const std::array<const Func*, all_arrays.size()> funcs{
      &model.filters, &model.scales, &model.windows,  &model.crossings,
      &model.biases,  &model.chroma, &model.nearness, &model.steepnesses};
  return *funcs[static_cast<size_t>(array)];
}

}  // namespace demosaic
