// drawing.cpp -- see drawing.h.
#include "drawing.h"

#include <algorithm>
#include <cmath>

#include "paraxial.h"
#include "reference_trace.h"

namespace lens {

using nlohmann::json;

namespace {

constexpr int profile_points = 41, rays_per_field = 5;

json profiles_of(const Scene& scene, const Lens& lens) {
  json profiles = json::array();
  double vertex = 0;
  for (size_t k = 0; k < lens.surfaces.size(); ++k) {
    const Surface& surface = lens.surfaces[k];
    // Without a rim, a surface is drawn as high as the pupil; the stop is drawn as high as its light.
    double rim = surface.semi_aperture > 0 ? surface.semi_aperture : 1.2 * scene.pupil_radius;
    if (surface.stop) rim = std::abs(paraxial(lens).stop_per_pupil) * scene.pupil_radius;
    json z = json::array(), y = json::array();
    for (int n = 0; n < profile_points; ++n) {
      const double h = rim * (2.0 * n / (profile_points - 1) - 1), depth = sag(surface, h);
      z.push_back(vertex + (std::isfinite(depth) ? depth : 0));
      y.push_back(h);
    }
    profiles.push_back({{"z", z},
                        {"y", y},
                        {"rim", rim},
                        {"stop", surface.stop},
                        {"glass", surface.index > 1.0001}});
    vertex += surface.spacing;
  }
  return profiles;
}

json rays_of(const Scene& scene, const Lens& lens) {
  json rays = json::array();
  for (size_t f = 0; f < scene.fields_degrees.size(); ++f) {
    for (int n = 0; n < rays_per_field; ++n) {
      const double degrees = scene.fields_degrees[f];
      const TracedRay ray = trace_ray(lens, degrees, 0, 2.0 * n / (rays_per_field - 1) - 1,
                                      scene.pupil_radius, line_d);
      if (ray.fate != Fate::Arrived) continue;
      // From slightly in front of the lens.
      const double before = 0.08 * scene.focal_length;
      json z = {ray.path[0][2] - before};
      json y = {ray.path[0][1] - before * std::tan(degrees * M_PI / 180)};
      for (const Point& at : ray.path) {
        z.push_back(at[2]);
        y.push_back(at[1]);
      }
      rays.push_back({{"field", f}, {"z", z}, {"y", y}});
    }
  }
  return rays;
}

json spots_of(const Scene& scene, const Lens& lens) {
  json out = json::array();
  const SpotReport report =
      spots(lens, scene.fields_degrees, scene.wavelengths, scene.pupil_radius);
  for (const SpotField& field : report.fields) {
    json colours = json::array();
    for (const double wavelength : scene.wavelengths) {
      json x = json::array(), y = json::array();
      for (const PupilPoint& p : pupil_points(8, 16)) {
        const TracedRay ray =
            trace_ray(lens, field.degrees, p.x, p.y, scene.pupil_radius, wavelength);
        if (ray.fate != Fate::Arrived) continue;
        for (const double side : {-1.0, 1.0}) {
          x.push_back(side * ray.x());
          y.push_back(ray.y() - field.centroid);
        }
      }
      colours.push_back({{"x", x}, {"y", y}});
    }
    out.push_back({{"degrees", field.degrees}, {"rms", field.rms}, {"points", colours}});
  }
  return out;
}

}  // namespace

json drawing_of(const Scene& scene, const Lens& lens, const std::string& name,
                const std::string& title) {
  return {{"name", name},
          {"title", title},
          {"image", lens.length()},
          {"profiles", profiles_of(scene, lens)},
          {"rays", rays_of(scene, lens)},
          {"spots", spots_of(scene, lens)}};
}

}  // namespace lens
