// objective.cpp -- see objective.h.
#include "objective.h"

namespace burst {

using lang::Expr;
using lang::RDom;

Objective::Objective(const Shape& shape, const Smoothness& smoothness, lang::Type scalar)
    : image(scalar, 3, "image"),
      homographies(scalar, 2, "homographies"),
      frames(scalar, 3, "frames"),
      weights(scalar, 1, "weights"),
      shape_(shape),
      scalar_(scalar) {
  if (shape.frames > 1) define_shift();
  define_sampled();
  define_loss(smoothness);
}

Expr Objective::number(double value) const { return lang::cast(scalar_, Expr(value)); }

// Clamped to a range one pixel larger than the picture, so that it fits an integer for any homography.
void Objective::define_shift() {
  const FrameSize& size = shape_.size;
  const auto h = [&](int k) { return Expr(homographies(k, i_)); };
  const Expr u = (lang::cast(scalar_, x_) - number(size.centre_x())) * number(1 / size.scale());
  const Expr v = (lang::cast(scalar_, y_) - number(size.centre_y())) * number(1 / size.scale());
  const Expr tilt = h(6) * u + h(7) * v;
  depth(x_, y_, i_) = number(1) + tilt;
  const Expr scale = number(size.scale()) / lang::max(depth(x_, y_, i_), number(least_depth));
  const auto clamped = [&](const Expr& shift, int side) {
    return lang::clamp(shift, number(-side - 1), number(side + 1));
  };
  shift_x(x_, y_, i_) = clamped((h(0) * u + h(1) * v + h(2) - u * tilt) * scale, size.width);
  shift_y(x_, y_, i_) = clamped((h(3) * u + h(4) * v + h(5) - v * tilt) * scale, size.height);
}

void Objective::define_sampled() {
  const Expr colour = x_ % 2 + y_ % 2;
  if (shape_.frames == 1) {
    sampled(x_, y_, i_) = image(x_, y_, colour);
    residual(x_, y_, i_) = sampled(x_, y_, i_) - frames(x_, y_, i_);
    return;
  }
  // Splits a position into the pixel left of it and its distance to that pixel, from 0 to 1. The fraction comes from
  // the shift, which has more significant digits than the position.
  const auto split = [&](const Expr& at, const Expr& shift, int side) {
    const Expr left = lang::clamp(at + lang::cast<int>(lang::floor(shift)), 0, side - 2);
    const Expr fraction = shift - lang::cast(scalar_, left - at);
    return std::pair(left, fraction);
  };
  const Expr dx = shift_x(x_, y_, i_), dy = shift_y(x_, y_, i_);
  const auto [left, fx] = split(x_, dx, shape_.size.width);
  const auto [top, fy] = split(y_, dy, shape_.size.height);
  const auto mix = [&](const Expr& a, const Expr& b, const Expr& f) { return a + f * (b - a); };
  const auto row = [&](const Expr& y, const Expr& f) {
    return mix(image(left, y, colour), image(left + 1, y, colour), f);
  };
  sampled(x_, y_, i_) = mix(row(top, fx), row(top + 1, fx), fy);
  const Expr seen = depth(x_, y_, i_) > number(least_depth) && fx >= number(0) && fx <= number(1) &&
                    fy >= number(0) && fy <= number(1);
  residual(x_, y_, i_) = lang::select(seen, sampled(x_, y_, i_) - frames(x_, y_, i_), number(0));
}

void Objective::define_loss(const Smoothness& smoothness) {
  const RDom r(0, shape_.size.width, 0, shape_.size.height, 0, shape_.frames, "sample");
  loss() = number(0);
  loss() += residual(r.x, r.y, r.z) * residual(r.x, r.y, r.z);
  for (size_t a = 0; a < smoothness.size(); ++a)
    add_differences(smoothness[a], weights(static_cast<int>(a)));
}

void Objective::add_differences(const ColourAxis& axis, const Expr& weight) {
  const auto along = [&](const Expr& x, const Expr& y) {
    Expr sum;
    for (int c = 0; c < 3; ++c) {
      const double share = axis.along[static_cast<size_t>(c)];
      if (share == 0) continue;
      const Expr term = share == 1 ? Expr(image(x, y, c)) : number(share) * image(x, y, c);
      sum = sum.defined() ? sum + term : term;
    }
    return sum;
  };
  const int width = shape_.size.width, height = shape_.size.height;
  const RDom across(0, width - 1, 0, height, "across"), down(0, width, 0, height - 1, "down");
  loss() += weight * lang::abs(along(across.x + 1, across.y) - along(across.x, across.y));
  loss() += weight * lang::abs(along(down.x, down.y + 1) - along(down.x, down.y));
}

}  // namespace burst
