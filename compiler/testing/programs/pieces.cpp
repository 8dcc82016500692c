// Pieces of typical image programs: stencils, inline reductions, argmin and argmax, boundary conditions, averages of
// rows, histograms, recursive filters, halved sizes. Any stage may be at root. Each reads only elements that exist, so
// a value or a gradient that needs more is wrong.
#include <algorithm>

#include "frontend/language/inline_reductions.h"
#include "testing/programs/maker.h"

namespace retrograde::fuzz {

// An image of any size; one-dimensional images are long.
void Maker::make_exact_image() {
  const bool is_flat = c_.chance(30);
  const int width = is_flat ? c_.between(3, 700) : c_.between(5, 70);
  const int height = is_flat ? 1 : c_.between(3, 40);
  Buffer<float> image(std::vector<int>{width, height}, "image");
  image.for_each_element([&](int i, int j) {
    image(i, j) = static_cast<float>((i * 7919 + j * 104729) % 2003) / 1000.0f - 1.0f;
  });
  p_.images.push_back(image);
  Func source("source");
  source(x, y) = image(x, y);
  keep(source, width, height);
}

void Maker::keep(const Func& f, int width, int height) {
  if (!exact_.empty() && c_.chance(45)) p_.roots.push_back(f);
  exact_.push_back({f, width, height});
  finish(f);
}

Maker::Exact Maker::recent() {
  const int n = static_cast<int>(exact_.size());
  return exact_[static_cast<size_t>(n - 1 - c_.below(std::min(n, 2)))];
}

void Maker::end_pieces() {
  p_.outputs = {exact_.back().f};
  p_.runs = {{{{0, 0}, {exact_.back().width, exact_.back().height}}}};
}

// The most common pieces are drawn as often as all others together.
void Maker::add_piece() {
  static constexpr void (Maker::*adds[])() = {&Maker::add_taps,      &Maker::add_window,
                                              &Maker::add_border,    &Maker::add_half,
                                              &Maker::add_histogram, &Maker::add_recursive_filter,
                                              &Maker::add_pointwise, &Maker::add_row_average};
  (this->*adds[c_.below(c_.chance(50) ? 3 : 8)])();
}

void Maker::add_taps() {
  const Exact a = recent();
  const int k = c_.between(1, 3), l = is_flat() ? 0 : c_.between(0, 2);
  if (a.width - k < 3 || a.height - l < 1) return;
  Func f = named("stencil");
  const Expr here = a.f(x, y), there = a.f(x + k, y + l);
  f(x, y) = c_.one_of<Expr>({
      [&] { return here * 0.5f + there * 0.25f; },
      [&] { return here * there + p_.scale; },
      [&] { return tanh(here - there * p_.scale); },
      [&] { return abs(a.f(x + k, y) - a.f(x, y + l)) + 0.125f * here; },
  });
  keep(f, a.width - k, a.height - l);
}

void Maker::add_window() {
  const Exact a = recent();
  const int k = c_.between(2, 5), l = is_flat() ? 1 : c_.between(1, 3);
  if (a.width - k < 3 || a.height - l < 1) return;
  const RDom r(0, k, 0, l);
  Func f = named("window");
  const Expr v = a.f(x + r.x, y + r.y), here = a.f(x, y);
  const auto best = [&] { return c_.chance(50) ? argmax(r, v) : argmin(r, v); };
  const auto at_best = [&] {
    const Tuple place = best();
    return a.f(x + clamp(place[0], 0, k - 1), y + clamp(place[1], 0, l - 1)) * place[2];
  };
  const auto best_value = [&] { return best()[2] * p_.scale + here; };
  f(x, y) = c_.one_of<Expr>({
      [&] { return sum(r, v * v) * 0.125f; },
      [&] { return maximum(r, v); },
      [&] { return sum(r, v * exp(-abs(v - here))); },
      [&] { return minimum(r, v * p_.scale) + here; },
      best_value,
      best_value,
      at_best,
      at_best,
  });
  keep(f, a.width - k + 1, a.height - l + 1);
}

void Maker::add_border() {
  const Exact a = recent();
  const Region region{{Expr(0), Expr(a.width)}, {Expr(0), Expr(a.height)}};
  const Func around = bounded(c_.below(4), 0.25f, a.f, region);
  const int k = c_.between(1, 3), l = is_flat() ? 0 : c_.between(0, 1);
  Func f = named("border");
  f(x, y) = around(x - k, y - l) + 0.5f * around(x + k, y + l) - a.f(x, y) * 0.25f;
  keep(f, a.width, a.height);
}

void Maker::add_half() {
  const Exact a = recent();
  if (a.width < 8) return;
  Func f = named("half");
  f(x, y) = (a.f(2 * x, y) + a.f(2 * x + 1, y)) * 0.5f;
  keep(f, a.width / 2, a.height);
}

void Maker::add_row_average() {
  const Exact a = recent();
  const RDom r(0, a.width);
  Func rows = named("rows"), f = named("centred");
  rows(y) = 0.0f;
  rows(y) += a.f(r, y);
  if (c_.chance(50)) p_.roots.push_back(rows);
  f(x, y) = a.f(x, y) - rows(y) * (1.0f / static_cast<float>(a.width));
  keep(f, a.width, a.height);
}

void Maker::add_histogram() {
  const Exact a = recent();
  const RDom r(0, a.width, 0, a.height);
  const Var bin("bin");
  const auto bin_of = [](const Expr& v) {
    return clamp(cast<int>(clamp(v * 4.0f + 4.0f, 0.0f, 7.0f)), 0, 7);
  };
  Func bins = named("bins"), f = named("levelled");
  bins(bin) = 0.0f;
  bins(bin_of(a.f(r.x, r.y))) += a.f(r.x, r.y);
  p_.roots.push_back(bins);
  f(x, y) = bins(bin_of(a.f(x, y))) * 0.001f + a.f(x, y);
  keep(f, a.width, a.height);
}

void Maker::add_recursive_filter() {
  const Exact a = recent();
  Func f = named("filter");
  const RDom r(1, a.width - 1);
  f(x, y) = a.f(x, y);
  f(r, y) = f(r, y) * 0.5f + f(r - 1, y) * 0.5f;
  keep(f, a.width, a.height);
}

void Maker::add_pointwise() {
  const Exact a = recent(), b = recent();
  Func f = named("pointwise");
  f(x, y) = c_.one_of<Expr>({
      [&] { return a.f(x, y) * p_.scale + b.f(x, y); },
      [&] { return sqrt(abs(a.f(x, y)) + 0.5f); },
      [&] { return exp(-a.f(x, y) * a.f(x, y)) * b.f(x, y); },
      [&] { return max(a.f(x, y), b.f(x, y) * 0.5f); },
  });
  keep(f, std::min(a.width, b.width), std::min(a.height, b.height));
}

}  // namespace retrograde::fuzz
