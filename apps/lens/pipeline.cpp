// pipeline.cpp -- see pipeline.h: traces the rays. loss.cpp computes the loss from them.
#include "pipeline.h"

#include <cmath>

#include "reference_trace.h"

namespace lens {

using namespace retrograde;

namespace {

// Limits on squared cosines: below `gone` a ray does not count, above `whole` it counts fully; 0.003 corresponds to an
// angle of 87 degrees.
constexpr double cosine_gone = 1e-3, cosine_whole = 5e-3;
// Width of the transition in squared height, relative to the rim's.
constexpr double rim_soft = 0.04;
// Rays far beyond a rim are clamped to it, so that they do not diverge on the next surfaces.
constexpr double farthest_in_rims = 4;

std::string numbered(const char* name, size_t k) { return name + std::to_string(k + 1); }

}  // namespace

LensModel::LensModel(const Scene& scene, Type real, const LossWeights& weights)
    : variables(real, 1, "variables"),
      goal(real, 1, "goal"),
      image("image"),
      light("light"),
      spot_square("spot_square"),
      loss("loss"),
      scene_(scene),
      real_(real),
      ray_{p_, f_} {
  if (scene_.has_dispersion()) ray_.push_back(w_);
  trace_paraxial();
  trace_rays();
  measure();
  const RDom fields(0, static_cast<int>(scene_.fields_degrees.size()), "fields");
  Func mean_spot("mean_spot");
  mean_spot() = value(0);
  mean_spot() +=
      spot_square(fields) *
      value(1.0 / static_cast<double>(scene_.fields_degrees.size()) / scene_.spot_square);
  loss() = mean_spot() + constraints(weights);
}

Expr LensModel::number(const std::string& group, size_t surface) const {
  for (size_t n = 0; n < scene_.variables.size(); ++n) {
    const Variable& v = scene_.variables[n];
    if (v.group == group && v.surface == surface)
      return value(v.scale) * variables(static_cast<int>(n));
  }
  Lens lens = scene_.lens;
  return value(number_of(lens, {group, surface}));
}

Expr LensModel::index(size_t surface) const {
  return scene_.lens.surfaces[surface].index == 1 ? value(1) : number("indices", surface);
}

Expr LensModel::index_at(size_t surface) const {
  const Surface& s = scene_.lens.surfaces[surface];
  if (scene_.wavelengths.size() == 1)
    return index(surface) + value(s.dispersion * cauchy_term(scene_.wavelengths[0]));
  if (s.dispersion == 0) return index(surface);
  std::vector<double> terms;
  for (const double wavelength : scene_.wavelengths)
    terms.push_back(s.dispersion * cauchy_term(wavelength));
  return index(surface) + table(numbered("dispersion", surface), terms)(w_);
}

Func LensModel::table(const std::string& name, const std::vector<double>& values) const {
  const auto filled = [&](auto buffer) {
    for (size_t n = 0; n < values.size(); ++n)
      buffer(static_cast<int>(n)) = static_cast<typename decltype(buffer)::ElemType>(values[n]);
    Var i("i");
    Func func(name);
    func(i) = buffer(i);
    return func;
  };
  const int size = static_cast<int>(values.size());
  return real_.bits() == 64 ? filled(Buffer<double>(size)) : filled(Buffer<float>(size));
}

// Two rays at line d, as in paraxial.cpp.
void LensModel::trace_paraxial() {
  Expr along = value(1), along_angle = value(0), through = value(0), through_angle = value(1);
  Expr before = value(1);
  for (size_t k = 0; k < scene_.lens.surfaces.size(); ++k) {
    const Surface& surface = scene_.lens.surfaces[k];
    if (surface.stop) {
      pupil_place_ = Func("pupil_place");
      pupil_place_() = through / along;
    }
    const Expr after = index(k);
    const Expr bend = surface.stop ? value(0) : number("curvatures", k) * (after - before);
    const Expr gap = number("spacings", k) / after;
    Func rays(numbered("paraxial", k));
    const Expr a = along_angle - along * bend, t = through_angle - through * bend;
    rays() = Tuple(along + gap * a, a, through + gap * t, t);
    along = rays()[0], along_angle = rays()[1], through = rays()[2], through_angle = rays()[3];
    before = after;
  }
  power_ = Func("power");
  power_() = -along_angle;
}

void LensModel::trace_rays() {
  Func rays = launched();
  for (size_t k = 0; k < scene_.lens.surfaces.size(); ++k) rays = through_surface(k, rays);
  const auto at = rays(std::vector<Expr>(ray_.begin(), ray_.end()));
  image(ray_) = Tuple(at[0], at[1], at[5]);
}

// Rays from the entrance pupil to the plane of the first vertex.
Func LensModel::launched() const {
  std::vector<double> x, y, sines, cosines;
  for (const PupilPoint& point : pupil_points(scene_.rings, scene_.spokes)) {
    x.push_back(point.x * scene_.pupil_radius);
    y.push_back(point.y * scene_.pupil_radius);
  }
  for (const double degrees : scene_.fields_degrees) {
    sines.push_back(std::sin(degrees * M_PI / 180));
    cosines.push_back(std::cos(degrees * M_PI / 180));
  }
  const Expr sine = table("sine", sines)(f_), cosine = table("cosine", cosines)(f_);
  Func rays("launched");
  rays(ray_) =
      Tuple(table("pupil_x", x)(p_), table("pupil_y", y)(p_) - pupil_place_() * sine / cosine,
            value(0), sine, cosine, value(1));
  return rays;
}

// A cubic step from 0 at `low` to 1 at `high`.
Expr LensModel::step(const Expr& at, double low, double high) const {
  const Expr t = clamp((at - value(low)) * value(1 / (high - low)), value(0), value(1));
  return t * t * (value(3) - value(2) * t);
}

// Traces rays through surface k to the plane of the next vertex (after the last surface: to the image).
Func LensModel::through_surface(size_t k, const Func& before) const {
  const Surface& surface = scene_.lens.surfaces[k];
  const auto ray = before(std::vector<Expr>(ray_.begin(), ray_.end()));
  const Expr x0 = ray[0], y0 = ray[1], L = ray[2], M = ray[3], N = ray[4];
  const Expr one = value(1), least = value(cosine_gone);
  const bool conic = scene_.has_conic(k);
  const Expr c = surface.stop ? value(0) : number("curvatures", k);
  const Expr kappa = conic ? number("conics", k) : value(0);

  const Expr F = c * (x0 * x0 + y0 * y0), G = N - c * (L * x0 + M * y0);
  const Expr A = conic ? c * (one + kappa * N * N) : c;
  const Expr H2 = G * G - A * F, H = sqrt(max(H2, least));
  const Expr travel = F / (max(G, least) + H);
  const Expr x = x0 + L * travel, y = y0 + M * travel, z = N * travel;
  const Expr r2 = x * x + y * y;
  Expr weight = ray[5] * step(H2, cosine_gone, cosine_whole);
  if (surface.semi_aperture > 0)
    weight *=
        step(one - r2 * value(1 / surface.semi_aperture / surface.semi_aperture), 0, rim_soft);

  Expr new_L = L, new_M = M, new_N = N;
  if (!surface.stop) {
    const Expr m = (k == 0 ? one : index_at(k - 1)) / index_at(k);
    const Expr E = conic ? sqrt(max(one - kappa * c * c * r2, least)) : one;
    const Expr I = H / E, J2 = one - m * m * (one - I * I), J = sqrt(max(J2, least));
    const Expr g = (J - m * I) / E;
    weight *= step(J2, cosine_gone, cosine_whole);
    new_L = m * L - g * c * x;
    new_M = m * M - g * c * y;
    new_N = m * N + g * (one - (conic ? one + kappa : one) * c * z);
  }
  const Expr forward = max(new_N, value(std::sqrt(cosine_gone)));
  const Expr on = (number("spacings", k) - z) / forward;
  const double reach = surface.semi_aperture > 0 ? farthest_in_rims * surface.semi_aperture
                                                 : 10 * scene_.focal_length;
  const auto kept = [&](const Expr& v) { return clamp(v, value(-reach), value(reach)); };
  const bool last = k + 1 == scene_.lens.surfaces.size();
  const Expr next_x = x + new_L * on, next_y = y + new_M * on;
  Func rays(numbered("rays", k));
  rays(ray_) = last ? Tuple(next_x, next_y, new_L, new_M, forward, weight)
                    : Tuple(kept(next_x), kept(next_y), new_L, new_M, forward, weight);
  return rays;
}

}  // namespace lens
