// loss.cpp -- the loss, computed from the rays at the image.
//
//   loss = mean over the fields of spot^2, relative to the start
//        + focal (f power - 1)^2                              the focal length, and so the F-number
//        + length h(length / goal - 1)^2                      h: a hinge, max(0, .)
//        + light mean h(light at the start - light)^2         losing rays must not reduce the loss
//        + distortion mean h(|height / (f tan field) - 1| - 2 %)^2   keeps the field of view
//        + thickness sum h(least - thickness, in the middle and at the rim)^2, in mm
//        + index sum h(outside of [1.48, 1.80])^2
#include <algorithm>
#include <cmath>

#include "pipeline.h"
#include "reference_trace.h"

namespace lens {

using namespace retrograde;

namespace {

constexpr double distortion_free = 0.02;
constexpr double lowest_index = 1.48, highest_index = 1.80;
// Least thicknesses of glass and air, in the middle and at the rim, relative to the focal length.
constexpr double glass_middle = 0.01, glass_rim = 0.005, air_middle = 0.002, air_rim = 0.0005;
constexpr double equator = 0.1;  // least value of 1 - (1 + k) c^2 h^2 at the rim

bool is_glass_gap(const Surface& s) { return s.index > 1.0001; }

}  // namespace

void LensModel::measure() {
  std::vector<double> weights;
  for (const PupilPoint& point : pupil_points(scene_.rings, scene_.spokes))
    weights.push_back(point.weight / static_cast<double>(scene_.wavelengths.size()));
  const Func weight = table("pupil_weight", weights);
  const int rays = static_cast<int>(weights.size());
  const RDom r = scene_.has_dispersion()
                     ? RDom(0, rays, 0, static_cast<int>(scene_.wavelengths.size()), "r")
                     : RDom(0, rays, "r");
  std::vector<Expr> at{r[0], f_};
  if (scene_.has_dispersion()) at.push_back(r[1]);
  const auto ray = image(at);
  const Expr counts = weight(r[0]) * ray[2];
  light(f_) = value(0);
  light(f_) += counts;
  Func heights("heights");
  heights(f_) = value(0);
  heights(f_) += counts * ray[1];
  const Expr some = max(light(f_), value(1e-6));
  height_ = Func("height");
  height_(f_) = heights(f_) / some;
  Func squares("squares");
  const Expr off = ray[1] - height_(f_);
  squares(f_) = value(0);
  squares(f_) += counts * (ray[0] * ray[0] + off * off);
  spot_square(f_) = squares(f_) / some;
}

Expr LensModel::sag_of(size_t k, double height) const {
  if (scene_.lens.surfaces[k].stop) return value(0);
  const Expr c = number("curvatures", k), h2 = value(height * height);
  const Expr inside = value(1) - (value(1) + number("conics", k)) * c * c * h2;
  return c * h2 / (value(1) + sqrt(max(inside, value(equator))));
}

// The squared shortfall of gap k in the middle and at its rim, and the violation of `equator` by its surface.
Expr LensModel::thickness(size_t k) const {
  const auto& all = scene_.lens.surfaces;
  const auto short_by = [&](double least, const Expr& what) {
    const Expr lack = max(value(least) - what, value(0));
    return lack * lack;
  };
  const double own = all[k].semi_aperture;
  Expr bent = value(0);
  if (own > 0 && !all[k].stop) {
    const Expr c = number("curvatures", k), h2 = value(own * own);
    const Expr inside = value(1) - (value(1) + number("conics", k)) * c * c * h2;
    bent = value(scene_.focal_length * scene_.focal_length) * short_by(equator, inside);
  }
  const bool glass = is_glass_gap(all[k]);
  const double f = scene_.focal_length;
  const double middle = std::min((glass ? glass_middle : air_middle) * f, all[k].spacing);
  const Expr sum = bent + short_by(middle, number("spacings", k));
  if (k + 1 == all.size()) return sum;
  const double h = std::min(all[k].semi_aperture, all[k + 1].semi_aperture);
  if (h <= 0) return sum;
  // If the initial lens is thinner, its own thickness is the limit.
  const double there = all[k].spacing + sag(all[k + 1], h) - sag(all[k], h);
  const double rim = std::min((glass ? glass_rim : air_rim) * f, there);
  return sum + short_by(rim, number("spacings", k) + sag_of(k + 1, h) - sag_of(k, h));
}

Expr LensModel::constraints(const LossWeights& weights) const {
  const double f = scene_.focal_length;
  const auto square = [](const Expr& e) { return e * e; };
  const auto hinge = [&](const Expr& e) { return max(e, value(0)); };
  Expr sum = value(weights.focal) * square(power_() * value(f) - value(1));
  Expr length = value(0), thin = value(0), indices = value(0);
  for (size_t k = 0; k < scene_.lens.surfaces.size(); ++k) {
    length += number("spacings", k);
    thin += thickness(k);
  }
  for (const Variable& v : scene_.variables) {
    if (v.group != "indices") continue;
    const Expr n = index(v.surface);
    indices += square(hinge(value(lowest_index) - n)) + square(hinge(n - value(highest_index)));
  }
  sum += value(weights.length) * square(hinge(length / goal(0) - value(1)));
  sum += value(weights.thickness) * thin + value(weights.index) * indices;

  const int fields = static_cast<int>(scene_.fields_degrees.size());
  std::vector<double> ideal;  // image heights without distortion
  for (const double degrees : scene_.fields_degrees)
    ideal.push_back(f * std::tan(degrees * M_PI / 180));
  ideal[0] = 1;  // on the axis the centroid is at 0
  const Func ideal_height = table("ideal_height", ideal),
             least = table("least_light", scene_.light);
  const RDom all(0, fields, "all"), off_axis(1, std::max(fields - 1, 1), "off_axis");
  Func lost("lost"), distorted("distorted");
  lost() = value(0);
  lost() += square(hinge(least(all) - light(all))) * value(weights.light / fields);
  sum += lost();
  if (fields < 2) return sum;
  const Expr bent = abs(height_(off_axis) / ideal_height(off_axis) - value(1));
  distorted() = value(0);
  distorted() += square(hinge(bent - value(distortion_free))) * value(weights.distortion / fields);
  return sum + distorted();
}

}  // namespace lens
