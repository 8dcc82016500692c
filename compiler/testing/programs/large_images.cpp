// Pieces of large programs that map images to images.
#include <algorithm>

#include "frontend/language/inline_reductions.h"
#include "testing/programs/large_maker.h"

namespace retrograde::fuzz {

// ---- element by element ----

LargeMaker::Image LargeMaker::pointwise(const Image& a) {
  Func f = named("pointwise");
  const Expr v = a.f(x, y, c);
  f(x, y, c) = c_.one_of<Expr>({
      [&] { return v * p_.scale + 0.25f; },
      [&] { return tanh(v); },
      [&] { return exp(-v * v); },
      [&] { return sqrt(v * v + 0.5f); },
      [&] { return pow(v * v + 0.5f, 1.0f / 2.2f); },
      [&] { return v / (1.0f + v * v); },
  });
  return {f, a.width, a.height, a.planes};
}

// Combines the image with an earlier one of its size, so that values have long lifetimes.
LargeMaker::Image LargeMaker::mixed(const Image& a) {
  const Image& other = images_[static_cast<size_t>(c_.below(static_cast<int>(images_.size())))];
  Func f = named("mixed");
  const Expr v = a.f(x, y, c);
  const bool is_same_size =
      other.width >= a.width && other.height >= a.height && other.planes >= a.planes;
  const Expr old = is_same_size ? other.f(x, y, c) : Expr(0.5f);
  f(x, y, c) = c_.chance(50) ? v * tanh(old) : v * 0.5f + old * old * 0.25f;
  return {f, a.width, a.height, a.planes};
}

// A few Funcs, each of which reads the previous one at several elements: inlined, they are thousands of reads.
LargeMaker::Image LargeMaker::copied_body(const Image& a) {
  if (a.width < 20 || !affords(a.elements() * 100)) return {};
  Func f = a.f;
  const int levels = c_.between(2, 5);
  for (int i = 0; i < levels; ++i) {
    Func g = named("body");
    g(x, y, c) = tanh(f(x, y, c) + f(x + 1, y, c)) * 0.5f + f(x + 2, y, c) * f(x + 3, y, c) * 0.25f;
    f = i + 1 < levels ? kept(g) : g;
  }
  return {f, a.width - 3 * levels, a.height, a.planes};
}

// ---- neighbours ----

LargeMaker::Image LargeMaker::stencil(const Image& a) {
  const int k = c_.between(0, 3), l = c_.between(0, 2);
  if (a.width <= k || a.height <= l) return {};
  Func f = named("stencil");
  const Expr here = a.f(x, y, c), there = a.f(x + k, y + l, c);
  f(x, y, c) = c_.chance(50) ? here * 0.5f + there * 0.25f : tanh(here * there);
  return {f, a.width - k, a.height - l, a.planes};
}

LargeMaker::Image LargeMaker::border(const Image& a) {
  using namespace BoundaryConditions;
  const Region region{{Expr(0), Expr(a.width)}, {Expr(0), Expr(a.height)}};
  const int kind = c_.below(4);
  const Func around = kind == 0   ? repeat_edge(a.f, region)
                      : kind == 1 ? constant_exterior(a.f, 0.25f, region)
                      : kind == 2 ? mirror_image(a.f, region)
                                  : repeat_image(a.f, region);
  const int k = c_.between(1, 3), l = c_.between(0, 2);
  Func f = named("border");
  f(x, y, c) =
      around(x - k, y - l, c) * 0.25f + around(x + k, y + l, c) * 0.5f - a.f(x, y, c) * 0.125f;
  return {f, a.width, a.height, a.planes};
}

// A chain of stencils, across and along: Jacobi steps, or blurs.
LargeMaker::Image LargeMaker::chain(const Image& a) {
  const int steps = c_.between(2, 6);
  const bool is_jacobi = c_.chance(50), is_smooth = c_.chance(50);
  Image last = a;
  if (!affords(a.elements() * 8 * steps)) return {};
  for (int i = 0; i < steps; ++i) {
    const Func& before = last.f;
    const auto at = [&](const Expr& u, const Expr& v) {
      return before(clamp(u, 0, a.width - 1), clamp(v, 0, a.height - 1), c);
    };
    Func f = named(is_jacobi ? "jacobi" : "blur");
    const Expr across = at(x - 1, y) + at(x + 1, y), along = at(x, y - 1) + at(x, y + 1);
    const Expr value = is_jacobi    ? (across + along) * 0.2f + a.f(x, y, c) * 0.2f
                       : i % 2 == 0 ? across * 0.25f + before(x, y, c) * 0.5f
                                    : along * 0.25f + before(x, y, c) * 0.5f;
    f(x, y, c) = is_smooth ? sin(value) : value;
    last.f = i + 1 < steps ? kept(f) : f;
  }
  return last;
}

LargeMaker::Image LargeMaker::transposed(const Image& a) {
  Func f = named("transposed");
  const bool turns_planes = c_.chance(30);
  if (turns_planes) {
    f(x, y, c) = a.f(c, y, x) * 0.5f;
    return {f, a.planes, a.height, a.width};
  }
  f(x, y, c) = a.f(y, x, c) * 0.5f;
  return {f, a.height, a.width, a.planes};
}

LargeMaker::Image LargeMaker::halved(const Image& a) {
  if (a.width < 4) return {};
  const bool both = c_.chance(50) && a.height >= 4;
  Func f = named("halved");
  const Expr v = both ? 2 * y : Expr(y);
  f(x, y, c) = (a.f(2 * x, v, c) + a.f(2 * x + 1, v, c)) * 0.5f;
  return {f, a.width / 2, both ? a.height / 2 : a.height, a.planes};
}

LargeMaker::Image LargeMaker::doubled(const Image& a) {
  if (!affords(a.elements() * 20) || a.elements() > 2e6) return {};
  Func f = named("doubled");
  f(x, y, c) = lerp(a.f(x / 2, y, c), a.f(min(x / 2 + 1, a.width - 1), y, c),
                    0.25f + 0.5f * cast<float>(x % 2));
  return {f, 2 * a.width, a.height, a.planes};
}

// ---- data-dependent indices ----

LargeMaker::Image LargeMaker::looked_up(const Image& a) {
  const Func at = steps(a), table = input(16, 1, c_.chance(50) ? a.planes : 1);
  const bool has_planes = p_.images.back().extent(2) > 1;
  Func f = named("looked_up");
  const Expr plane = has_planes ? Expr(c) : Expr(0), bin = bin_of(at(x, y, c));
  const Expr entry = c_.chance(50)
                         ? table(bin, 0, plane)
                         : lerp(table(bin, 0, plane), table(min(bin + 1, 15), 0, plane), 0.25f);
  f(x, y, c) = entry * a.f(x, y, c);
  return {f, a.width, a.height, a.planes};
}

// Interpolates between pixels, by a displacement that is the same for all planes, or one for each.
LargeMaker::Image LargeMaker::warped(const Image& a) {
  if (!affords(a.elements() * 40)) return {};
  const bool each = c_.chance(25), both = c_.chance(60);
  const Func flow = input(a.width, a.height, each ? a.planes : 1);
  const Expr u = flow(x, y, each ? Expr(c) : Expr(0)) * 2.37f + 0.000313f;
  const Expr whole = floor(u), w = u - whole, shift = cast<int>(clamp(whole, -4.0f, 4.0f));
  const auto column = [&](int k) { return clamp(x + shift + k, 0, a.width - 1); };
  const auto row = [&](int k) { return both ? clamp(y - shift + k, 0, a.height - 1) : Expr(y); };
  const auto between = [&](const Expr& v) {
    return lerp(a.f(column(0), v, c), a.f(column(1), v, c), w);
  };
  Func f = named("warped");
  f(x, y, c) = both ? lerp(between(row(0)), between(row(1)), w * 0.5f) : between(row(0));
  return {f, a.width, a.height, a.planes};
}

// Selects, at each pixel, the plane in which an input is largest; the reduction is a Tuple.
LargeMaker::Image LargeMaker::best_plane(const Image& a) {
  if (!affords(a.elements() * a.planes * 4)) return {};
  const Func scores = steps(a);
  const RDom r(0, a.planes);
  const Tuple best = argmax(r, scores(x, y, r));
  Func f = named("best");
  f(x, y, c) = a.f(x, y, clamp(best[0], 0, a.planes - 1)) * best[1] + a.f(x, y, c) * 0.5f;
  return {f, a.width, a.height, a.planes};
}

}  // namespace retrograde::fuzz
