// pipeline.h -- the lens as a pipeline: traces rays through all surfaces and computes the loss.
//
// A ray is (x, y) on the plane of the next vertex, the direction cosines (L, M, N), and a weight at the image. At a
// surface of curvature c and conic constant k (G. Spencer, M. Murty, General ray-tracing procedure, JOSA 52, 1962; W.
// Welford, Aberrations of Optical Systems, section 4)
//
//   F = c (x^2 + y^2),  G = N - c (L x + M y),  A = c (1 + k N^2),  H = sqrt(G^2 - A F)
//   it travels F / (G + H) to the surface; H is the cosine of incidence times E, where
//   E = sqrt(1 - k c^2 r^2) is the length of the normal (-c x, -c y, 1 - (1 + k) c z)
//   with m = n / n', I = H / E:  J = sqrt(1 - m^2 (1 - I^2)),  g = J - m I
//   (L, M, N) <- m (L, M, N) + g normal / E
//
// With k = 0: A = c, E = 1. Terms of planes in glass that is not optimized fold to constants.
//
// Masks. If H^2 or J^2 falls below a limit, the ray misses the surface or is totally reflected; beyond the rim it is
// vignetted. Square roots are taken of values clamped to the limit, so nothing is infinite or NaN. The weight falls to
// 0 smoothly before the limit (a cubic step), so that the loss has a gradient. Losing rays must not reduce the loss: it
// requires as much light in every field as the initial lens has.
#pragma once

#include <retrograde/retrograde.h>

#include "scene.h"

namespace lens {

struct LossWeights {
  double focal = 1e5, length = 1e5, light = 1e3, distortion = 1e3, thickness = 1e1, index = 1e3;
};

class LensModel {
 public:
  LensModel(const Scene& scene, retrograde::Type real, const LossWeights& weights = {});

  retrograde::ImageParam variables;  // (n), in the optimizer's units
  retrograde::ImageParam goal;       // (1): the length, mm
  retrograde::Func image;            // (ray, field[, wavelength]): x, y, weight, at the image
  retrograde::Func light;            // (field): share of the rays that arrived
  retrograde::Func spot_square;      // (field): mm^2, about the centroid
  retrograde::Func loss;

 private:
  struct Glass;
  using Expr = retrograde::Expr;
  using Func = retrograde::Func;

  Expr value(double number) const { return retrograde::cast(real_, Expr(number)); }
  // A number of the lens: a variable, or a constant if it is not optimized.
  Expr number(const std::string& group, size_t surface) const;
  Expr index(size_t surface) const;  // of the medium behind it, at line d
  // A one-dimensional Func with these values.
  Func table(const std::string& name, const std::vector<double>& values) const;

  void trace_paraxial();
  void trace_rays();
  Func launched() const;
  Func through_surface(size_t k, const Func& before) const;
  Func to_image(const Func& before) const;
  Expr index_at(size_t surface) const;  // at the wavelength of the variable `w_`
  Expr step(const Expr& value, double low, double high) const;

  void measure();
  Expr constraints(const LossWeights& weights) const;
  Expr thickness(size_t k) const;
  Expr sag_of(size_t k, double height) const;

  const Scene scene_;
  retrograde::Type real_;
  retrograde::Var p_{"p"}, f_{"f"}, w_{"w"};
  std::vector<retrograde::Var> ray_;  // p, f and, with dispersion, w
  Func power_, pupil_place_;          // scalars
  Func height_;                       // (field): of the centroid
};

}  // namespace lens
