// Deep multi-resolution programs as users write them: pyramids, multigrid, U-shaped nets, means of patches. Their
// stages halve and double images many times, with and without boundary conditions.
#pragma once

#include <functional>
#include <vector>

#include "frontend/data/image_param.h"
#include "frontend/language/boundary_conditions.h"
#include "frontend/language/func.h"
#include "frontend/language/inline_reductions.h"

namespace retrograde::deep {

enum class Border { None, Repeat, Mirror, Zero };

template <typename Image>
Func bordered(const Image& image, Border border) {
  if (border == Border::Repeat) return BoundaryConditions::repeat_edge(image);
  if (border == Border::Mirror) return BoundaryConditions::mirror_interior(image);
  if (border == Border::Zero) return BoundaryConditions::constant_exterior(image, 0.0f);
  Func result;
  result(_) = image(_);
  return result;
}

class Pyramids {
 public:
  // Fills the holes of an image with 4 channels, the last of which is the confidence of a pixel.
  template <typename Image>
  Func interpolation(const Image& input, int levels, Border border) {
    std::vector<Func> down(levels), up(levels);
    const Func known = bordered(input, border);
    down[0](x, y, c) = select(c < 3, known(x, y, c) * known(x, y, 3), known(x, y, 3));
    for (int l = 1; l < levels; ++l) {
      Func rows, previous = down[l - 1];
      rows(x, y, c) =
          (previous(x * 2 - 1, y, c) + 2.0f * previous(x * 2, y, c) + previous(x * 2 + 1, y, c)) *
          0.25f;
      down[l](x, y, c) =
          (rows(x, y * 2 - 1, c) + 2.0f * rows(x, y * 2, c) + rows(x, y * 2 + 1, c)) * 0.25f;
    }
    up[levels - 1] = down[levels - 1];
    for (int l = levels - 2; l >= 0; --l) {
      Func rows, both;
      rows(x, y, c) = (up[l + 1](x / 2, y, c) + up[l + 1]((x + 1) / 2, y, c)) / 2.0f;
      both(x, y, c) = (rows(x, y / 2, c) + rows(x, (y + 1) / 2, c)) / 2.0f;
      up[l](x, y, c) = down[l](x, y, c) + (1.0f - down[l](x, y, 3)) * both(x, y, c);
    }
    Func result;
    result(x, y, c) = up[0](x, y, c) / (up[0](x, y, 3) + 0.01f);
    return result;
  }

  // Local contrast around 8 brightness levels.
  template <typename Image>
  Func local_laplacian(const Image& input, int levels, Border border) {
    const int brightnesses = 8;
    const Func image = bordered(input, border);
    Func grey;
    grey(x, y) = 0.299f * image(x, y, 0) + 0.587f * image(x, y, 1) + 0.114f * image(x, y, 2);
    std::vector<Func> remapped(levels), greys(levels), result(levels);
    Expr off = (grey(x, y) - k * (1.0f / (brightnesses - 1))) * 4.0f;
    remapped[0](x, y, k) = grey(x, y) + 0.3f * off * exp(-off * off);
    greys[0] = grey;
    for (int l = 1; l < levels; ++l) {
      remapped[l](x, y, k) = halved(remapped[l - 1])(x, y, k);
      greys[l](x, y) = halved(greys[l - 1])(x, y);
    }
    for (int l = levels - 1; l >= 0; --l) {
      Func detail;
      detail(x, y, k) = l + 1 < levels ? remapped[l](x, y, k) - doubled(remapped[l + 1])(x, y, k)
                                       : Expr(remapped[l](x, y, k));
      Expr brightness = clamp(greys[l](x, y), 0.0f, 1.0f) * cast<float>(brightnesses - 1);
      Expr below = clamp(cast<int>(brightness), 0, brightnesses - 2);
      Expr share = brightness - cast<float>(below);
      Expr value = (1.0f - share) * detail(x, y, below) + share * detail(x, y, below + 1);
      if (l + 1 < levels) value = value + doubled(result[l + 1])(x, y);
      result[l](x, y) = value;
    }
    Func out;
    out(x, y, c) = result[0](x, y) * (image(x, y, c) + 0.01f) / (grey(x, y) + 0.01f);
    return out;
  }

  // V-cycles for the Poisson equation.
  template <typename Image>
  Func multigrid(const Image& right_side, int levels, Border border) {
    Func zero;
    zero(x, y) = 0.0f;
    return cycle(zero, bordered(right_side, border), levels);
  }

  // Convolutions of 3 x 3 with `weights`(x, y, from, to, layer).
  template <typename Image, typename Weights>
  Func net(const Image& input, const Weights& weights, int levels, int channels) {
    int layer = 0;
    const auto convolved = [&](const Func& f, int from) {
      Func sums, result;
      RDom r(0, 3, 0, 3, 0, from);
      sums(x, y, c) = 0.0f;
      sums(x, y, c) += f(x + r.x - 1, y + r.y - 1, r.z) * weights(r.x, r.y, r.z, c, Expr(layer++));
      result(x, y, c) = max(sums(x, y, c), 0.0f);
      return result;
    };
    const std::function<Func(const Func&, int)> made = [&](const Func& f, int level) -> Func {
      const Func fine = convolved(f, channels);
      if (level == 1) return fine;
      Func pooled, both;
      pooled(x, y, c) = max(max(fine(2 * x, 2 * y, c), fine(2 * x + 1, 2 * y, c)),
                            max(fine(2 * x, 2 * y + 1, c), fine(2 * x + 1, 2 * y + 1, c)));
      const Func coarse = made(pooled, level - 1);
      both(x, y, c) = select(c < channels, fine(x, y, min(c, channels - 1)),
                             coarse(x / 2, y / 2, max(c - channels, 0)));
      return convolved(both, 2 * channels);
    };
    return made(bordered(input, Border::Zero), levels);
  }

  // Non-local means: each pixel is the mean of a window, weighted by the similarity of patches.
  template <typename Image>
  Func means_of_patches(const Image& input, int patch, int window, Border border) {
    const Func image = bordered(input, border);
    Func squares, rows, patches, weights, sums, result;
    Expr difference = image(x, y, c) - image(x + dx, y + dy, c);
    RDom channel(0, 3), p(-patch, 2 * patch + 1),
        r(-window, 2 * window + 1, -window, 2 * window + 1);
    squares(x, y, c, dx, dy) = difference * difference;
    rows(x, y, dx, dy) = sum(squares(x + p, y, 0, dx, dy) + squares(x + p, y, 1, dx, dy) +
                             squares(x + p, y, 2, dx, dy));
    patches(x, y, dx, dy) = sum(rows(x, y + p, dx, dy));
    weights(x, y, dx, dy) = exp(-0.5f * patches(x, y, dx, dy));
    sums(x, y, c) +=
        weights(x, y, r.x, r.y) * select(c < 3, image(x + r.x, y + r.y, min(c, 2)), 1.0f);
    result(x, y, c) = sums(x, y, c) / sums(x, y, 3);
    return result;
  }

 private:
  Var x{"x"}, y{"y"}, c{"c"}, k{"k"}, dx{"dx"}, dy{"dy"};

  Func halved(const Func& f) {
    Func rows, both;
    rows(x, y, _) =
        (f(2 * x - 1, y, _) + 3.0f * (f(2 * x, y, _) + f(2 * x + 1, y, _)) + f(2 * x + 2, y, _)) /
        8.0f;
    both(x, y, _) = (rows(x, 2 * y - 1, _) + 3.0f * (rows(x, 2 * y, _) + rows(x, 2 * y + 1, _)) +
                     rows(x, 2 * y + 2, _)) /
                    8.0f;
    return both;
  }
  Func doubled(const Func& f) {
    Func rows, both;
    rows(x, y, _) = 0.25f * f((x / 2) - 1 + 2 * (x % 2), y, _) + 0.75f * f(x / 2, y, _);
    both(x, y, _) = 0.25f * rows(x, (y / 2) - 1 + 2 * (y % 2), _) + 0.75f * rows(x, y / 2, _);
    return both;
  }

  Expr residual(const Func& u, const Func& f) {
    return f(x, y) - (u(x - 1, y) + u(x + 1, y) + u(x, y - 1) + u(x, y + 1) - 4.0f * u(x, y));
  }
  Func smoothed(const Func& u, const Func& f) {
    Func result;
    result(x, y) = u(x, y) - 0.2f * residual(u, f);
    return result;
  }
  Func cycle(const Func& start, const Func& f, int levels) {
    Func u = smoothed(smoothed(start, f), f);
    if (levels > 1) {
      Func left, coarse, zero, sum;
      left(x, y) = residual(u, f);
      coarse(x, y) = left(2 * x, 2 * y) + left(2 * x + 1, 2 * y) + left(2 * x, 2 * y + 1) +
                     left(2 * x + 1, 2 * y + 1);
      zero(x, y) = 0.0f;
      sum(x, y) = u(x, y) + cycle(zero, coarse, levels - 1)(x / 2, y / 2);
      u = sum;
    }
    return smoothed(smoothed(u, f), f);
  }
};

}  // namespace retrograde::deep
