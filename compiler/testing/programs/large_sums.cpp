// Pieces of large programs that sum, scan and scatter images.
#include <algorithm>

#include "testing/programs/large_maker.h"

namespace retrograde::fuzz {

// ---- weights that are learned ----

LargeMaker::Image LargeMaker::planes_mixed(const Image& a) {
  const int planes = c_.between(1, 8);
  if (!affords(a.width * double(a.height) * a.planes * planes * 6)) return {};
  const Func weights = input(a.planes, 1, planes);
  const RDom r(0, a.planes);
  Func f = named("planes_mixed");
  f(x, y, c) = 0.0f;
  f(x, y, c) += a.f(x, y, r) * weights(r, 0, c);
  Func scaled = named("mixed");
  scaled(x, y, c) = tanh(kept(f)(x, y, c) * 0.25f);
  return {scaled, a.width, a.height, planes};
}

LargeMaker::Image LargeMaker::convolved(const Image& a) {
  const int k = c_.between(2, 5), l = c_.between(1, 3), planes = c_.between(1, 6);
  if (a.width < k || a.height < l || !affords(a.elements() * k * l * planes * 6)) return {};
  const Func weights = input(k * l, a.planes, planes);
  const RDom r(0, k, 0, l, 0, a.planes);
  Func f = named("conv");
  if (c_.chance(40)) {  // each plane separately
    const RDom q(0, k, 0, l);
    f(x, y, c) = 0.0f;
    f(x, y, c) += a.f(x + q.x, y + q.y, c) * weights(q.x + k * q.y, c, 0);
    return {f, a.width - k + 1, a.height - l + 1, a.planes};
  }
  f(x, y, c) = 0.125f;
  f(x, y, c) += a.f(x + r.x, y + r.y, r.z) * weights(r.x + k * r.y, r.z, c);
  Func scaled = named("activated");
  scaled(x, y, c) = tanh(kept(f)(x, y, c) * 0.25f);
  return {scaled, a.width - k + 1, a.height - l + 1, planes};
}

// Multiplies each plane, as a matrix, by a common one or by one of its own.
LargeMaker::Image LargeMaker::multiplied(const Image& a) {
  const int columns = sizes_ == LargeSizes::Small ? 19 : c_.between(0, 3) * 33 + c_.between(1, 33);
  if (!affords(a.elements() * columns * 6) || a.width > 3000) return {};
  const bool each = c_.chance(60);
  const Func b = input(columns, a.width, each ? a.planes : 1);
  const RDom r(0, a.width);
  Func f = named("product");
  f(x, y, c) = 0.0f;
  f(x, y, c) += a.f(r, y, c) * b(x, r, each ? Expr(c) : Expr(0));
  Func scaled = named("scaled");
  scaled(x, y, c) = kept(f)(x, y, c) * 0.0625f;
  return {scaled, columns, a.height, a.planes};
}

// ---- scans ----

LargeMaker::Image LargeMaker::row_scan(const Image& a) {
  if (a.width < 3) return {};
  Func f = named("row_scan");
  f(x, y, c) = a.f(x, y, c);
  const RDom r(1, a.width - 1);
  const Expr at = c_.chance(30) ? a.width - 1 - r : Expr(r);
  const Expr before = c_.chance(30) ? f(max(r - 2, 0), y, c) : f(r - 1, y, c);
  f(r, y, c) = f(r, y, c) * 0.5f + before * 0.5f;
  if (c_.chance(50)) f(at, y, c) = f(at, y, c) * 0.75f;
  return {f, a.width, a.height, a.planes};
}

LargeMaker::Image LargeMaker::column_scan(const Image& a) {
  if (a.height < 3) return {};
  Func f = named("column_scan");
  f(x, y, c) = a.f(x, y, c);
  const RDom r(1, a.height - 1);
  f(x, r, c) = f(x, r, c) * 0.25f + f(x, r - 1, c) * 0.5f;
  if (c_.chance(50)) {
    const Expr back = a.height - 1 - r;
    f(x, back, c) = f(x, back, c) * 0.5f + f(x, back + 1, c) * 0.25f;
  }
  return {f, a.width, a.height, a.planes};
}

// A recursive filter along both axes, composed of one filter and transposes.
LargeMaker::Image LargeMaker::filtered_twice(const Image& a) {
  if (a.height < 3 || a.width < 3) return {};
  const Image down = column_scan(a);
  kept(down.f);
  Func turned = named("turned");
  turned(x, y, c) = down.f(y, x, c);
  const Image across = column_scan({kept(turned), a.height, a.width, a.planes});
  kept(across.f);
  Func f = named("filtered");
  f(x, y, c) = across.f(y, x, c);
  return {f, a.width, a.height, a.planes};
}

// ---- scatters ----

// A histogram of weights by an input's steps, over all planes or for each; it is read at a data-dependent index.
LargeMaker::Image LargeMaker::levelled(const Image& a) {
  const bool each = c_.chance(60), counts = c_.chance(40);
  const Func at = steps(a);
  Func bins = named("bins");
  const RDom r(0, a.width, 0, a.height, 0, each ? 1 : a.planes);
  const Expr from = each ? Expr(c) : Expr(r.z), to = each ? Expr(c) : Expr(0);
  const Expr bin = bin_of(at(r.x, r.y, from)), v = a.f(r.x, r.y, from);
  if (counts) {
    bins(x, c) = Tuple(0.0f, 0.0f);
    bins(bin, to) = Tuple(bins(bin, to)[0] + v, bins(bin, to)[1] + 1.0f);
  } else {
    bins(x, c) = 0.0f;
    bins(bin, to) += v;
  }
  kept(bins);
  const Expr here = bin_of(at(x, y, c)), plane = each ? Expr(c) : Expr(0);
  Func f = named("levelled");
  const float share = 16.0f / static_cast<float>(a.elements());
  f(x, y, c) = a.f(x, y, c) * 0.5f + (counts ? bins(here, plane)[0] / (bins(here, plane)[1] + 1.0f)
                                             : bins(here, plane) * share);
  return {f, a.width, a.height, a.planes};
}

// Scatters each element nearby, by an input that is the same for all planes, or one for each.
LargeMaker::Image LargeMaker::splatted(const Image& a) {
  if (!affords(a.elements() * 30)) return {};
  const bool each = c_.chance(40), down = c_.chance(50);
  const Func at = input(a.width, a.height, each ? a.planes : 1);
  const RDom r(0, a.width, 0, a.height);
  const Expr shift = bin_of(at(r.x, r.y, each ? Expr(c) : Expr(0))) / 4 - 2;
  const Expr u = clamp(r.x + shift, 0, a.width - 1),
             v = down ? clamp(r.y + shift, 0, a.height - 1) : Expr(r.y);
  Func f = named("splatted");
  f(x, y, c) = 0.0f;
  f(u, v, c) += a.f(r.x, r.y, c);
  Func scaled = named("spread");
  scaled(x, y, c) = tanh(kept(f)(x, y, c));
  return {scaled, a.width, a.height, a.planes};
}

// ---- averages ----

LargeMaker::Image LargeMaker::centred(const Image& a) {
  const int what = c_.below(3);
  const RDom r(0, a.width, 0, what == 0 ? 1 : a.height, 0, what < 2 ? 1 : a.planes);
  const Expr v = what == 0 ? a.f(r.x, y, c) : what == 1 ? a.f(r.x, r.y, c) : a.f(r.x, r.y, r.z);
  const double terms = what == 0 ? a.width : what == 1 ? double(a.width) * a.height : a.elements();
  const auto share = static_cast<float>(1 / terms);
  Func means = named("means"), f = named("centred");
  if (what == 0) {
    means(y, c) = 0.0f;
    means(y, c) += v;
    f(x, y, c) = a.f(x, y, c) - kept(means)(y, c) * share;
  } else if (what == 1) {
    means(c) = 0.0f;
    means(c) += v;
    f(x, y, c) = a.f(x, y, c) - kept(means)(c) * share;
  } else {
    means() = 0.0f;
    means() += v;
    f(x, y, c) = a.f(x, y, c) - kept(means)() * share;
  }
  return {f, a.width, a.height, a.planes};
}

// Normalises by the mean and the variance of each plane: one Tuple, or two Funcs with the same operands.
LargeMaker::Image LargeMaker::normalised(const Image& a) {
  const RDom r(0, a.width, 0, a.height), q(0, a.width, 0, a.height);
  const float share = 1.0f / (static_cast<float>(a.width) * static_cast<float>(a.height));
  const Expr v = a.f(r.x, r.y, c), w = a.f(q.x, q.y, c);
  Func sums = named("sums"), f = named("normalised");
  Expr mean, squares;
  if (c_.chance(50)) {
    sums(c) = Tuple(0.0f, 0.0f);
    sums(c) = Tuple(sums(c)[0] + v, sums(c)[1] + v * v);
    kept(sums);
    mean = sums(c)[0] * share;
    squares = sums(c)[1] * share;
  } else {
    sums(c) = 0.0f;
    sums(c) += v;
    kept(sums);
    Func of_squares = named("squares");
    of_squares(c) = 0.0f;
    of_squares(c) += w * w;
    kept(of_squares);
    mean = sums(c) * share;
    squares = of_squares(c) * share;
  }
  f(x, y, c) = (a.f(x, y, c) - mean) / sqrt(abs(squares - mean * mean) + 0.5f);
  return {f, a.width, a.height, a.planes};
}

// Means of neighbouring patches, weighted by their similarity.
LargeMaker::Image LargeMaker::patched(const Image& a) {
  const int shifts = c_.between(2, 10), patch = c_.between(1, 3);
  if (a.width < shifts + patch + 1 || a.height < patch ||
      !affords(a.elements() * shifts * (patch * patch + 10)))
    return {};
  const Var d("d");
  Func apart = named("apart"), distance = named("distance"), f = named("patched");
  const Expr difference = a.f(x, y, c) - a.f(x + d, y, c);
  apart(x, y, c, d) = difference * difference;
  const RDom around(0, patch, 0, patch), r(1, shifts);
  distance(x, y, c, d) = 0.0f;
  distance(x, y, c, d) += kept(apart)(x + around.x, y + around.y, c, d);
  kept(distance);
  f(x, y, c) = a.f(x, y, c);
  f(x, y, c) += exp(-distance(x, y, c, r)) * a.f(x + r, y, c);
  return {f, a.width - shifts - patch, a.height - patch + 1, a.planes};
}

// Values of pairs of elements, which are read for either element.
LargeMaker::Image LargeMaker::paired(const Image& a) {
  const int shifts = c_.between(6, 12), k = c_.between(0, 2);
  if (a.width < shifts + k + 2 || a.height < k + 1 || !affords(a.elements() * shifts * 12))
    return {};
  const Var d("d");
  Func pair = named("pair"), f = named("paired");
  const Expr here = a.f(x, y, c), there = a.f(x + d, y, c);
  pair(x, y, c, d) = exp((here - there) * (there - here)) * (here + 0.5f * there);
  kept(pair);
  const RDom r(1, shifts);
  f(x, y, c) = 0.0f;
  f(x, y, c) += pair(x, y, c, r) - 0.5f * pair(x + k, y + (k > 0 ? 1 : 0), c, r);
  return {f, a.width - shifts - k, a.height - (k > 0 ? 1 : 0), a.planes};
}

// Sums of rows under a predicate over coordinates, or over an input.
LargeMaker::Image LargeMaker::partly_summed(const Image& a) {
  RDom r(0, a.width);
  const int how = c_.below(3);
  if (how == 0) {
    r.where(r.x % 3 != 1);
  } else if (how == 1) {
    r.where(r.x + y < a.width);
  } else {
    const Func at = steps(a);
    r.where(at(r.x, y, c) > 0.0005f);
  }
  Func rows = named("rows"), f = named("partly");
  rows(y, c) = 0.0f;
  rows(y, c) += a.f(r.x, y, c);
  const float share = 1.0f / static_cast<float>(a.width);
  f(x, y, c) = a.f(x, y, c) + kept(rows)(y, c) * share;
  return {f, a.width, a.height, a.planes};
}

// Two Funcs that gather from the same table at the same indices.
LargeMaker::Image LargeMaker::summed_twice(const Image& a) {
  if (!affords(a.elements() * 20)) return {};
  const Func at = steps(a), table = input(16, 1, 1);
  const RDom r(0, a.planes), q(0, a.planes);
  Func sums = named("sums"), squares = named("squares"), f = named("both");
  const Expr entry = table(bin_of(at(x, y, r)), 0, 0), same = table(bin_of(at(x, y, q)), 0, 0);
  sums(x, y) = 0.0f;
  sums(x, y) += entry * a.f(x, y, r);
  squares(x, y) = 0.0f;
  squares(x, y) += same * same;
  f(x, y, c) = a.f(x, y, c) + kept(sums)(x, y) / (kept(squares)(x, y) + 1.0f);
  return {f, a.width, a.height, a.planes};
}

LargeMaker::Image LargeMaker::summed_over_planes(const Image& a) {
  if (!affords(a.elements() * 8)) return {};
  const RDom r(0, a.planes);
  Func sums = named("over_planes");
  sums(x, y) = 0.0f;
  sums(x, y) += a.f(x, y, r) * a.f(x, y, r);
  Func f = named("divided");
  f(x, y, c) = a.f(x, y, c) / (kept(sums)(x, y) + 1.0f);
  return {f, a.width, a.height, a.planes};
}

}  // namespace retrograde::fuzz
