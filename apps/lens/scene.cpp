// scene.cpp -- see scene.h.
#include "scene.h"

#include <algorithm>
#include <cmath>

#include "diagnostics/error.h"
#include "paraxial.h"
#include "reference_trace.h"

namespace lens {

using retrograde::quoted;
using retrograde::text;

namespace {

bool is_glass(const Surface& surface) { return surface.index > 1.0001; }

// Refracting surfaces have curvatures and conics, glass has indices; every gap has a spacing.
bool has_number(const Surface& surface, const std::string& group) {
  if (group == "spacings") return true;
  if (group == "indices") return is_glass(surface);
  return !surface.stop;
}

double scale_of(const std::string& group, double focal_length) {
  if (group == "curvatures") return 1e-2 / focal_length;
  if (group == "spacings") return 1e-2 * focal_length;
  return group == "indices" ? 1e-2 : 1e-1;
}

void add_variables(Scene& scene, const std::string& group) {
  const size_t before = scene.variables.size();
  for (size_t k = 0; k < scene.lens.surfaces.size(); ++k) {
    if (has_number(scene.lens.surfaces[k], group))
      scene.variables.push_back({group, k, scale_of(group, scene.focal_length)});
  }
  if (scene.variables.size() == before) {
    retrograde::call_error(text("optimize the ", group), "there must be some",
                           text(quoted(scene.lens.name), " has none"), "Leave them out");
  }
}

// Equal steps of image height.
std::vector<double> fields_of(double half_field_degrees, int count) {
  const double largest = std::tan(half_field_degrees * M_PI / 180);
  std::vector<double> fields;
  for (int n = 0; n < count; ++n)
    fields.push_back(std::atan(largest * n / std::max(count - 1, 1)) * 180 / M_PI);
  return fields;
}

std::vector<double> wavelengths_of(int count) {
  if (count == 1) return {line_d};
  if (count == 2) return {line_F, line_C};
  return {line_F, line_d, line_C};
}

void measure_start(Scene& scene) {
  const SpotReport report = spots(scene.lens, scene.fields_degrees, scene.wavelengths,
                                  scene.pupil_radius, scene.rings, scene.spokes);
  double sum = 0;
  for (const SpotField& field : report.fields) {
    scene.light.push_back(field.light);
    sum += field.rms * field.rms;
    if (field.light > 0.02) continue;
    retrograde::call_error(
        text("use the lens ", quoted(scene.lens.name)), "light of every field must arrive",
        text("at ", field.degrees, " degrees ", 100 * field.light, " % of it does"),
        "Give it larger rims, a smaller half_field_degrees or a larger f_number");
  }
  scene.spot_square = sum / static_cast<double>(report.fields.size());
}

}  // namespace

bool Scene::has_conic(size_t surface) const {
  if (lens.surfaces[surface].conic != 0) return true;
  return std::any_of(variables.begin(), variables.end(), [&](const Variable& v) {
    return v.group == "conics" && v.surface == surface;
  });
}

bool Scene::has_rims() const {
  return std::any_of(lens.surfaces.begin(), lens.surfaces.end(),
                     [](const Surface& s) { return s.semi_aperture > 0; });
}

Scene make_scene(const Lens& lens, const SceneOptions& options) {
  Scene scene;
  scene.lens = lens;
  scene.focal_length = paraxial(lens).focal_length();
  scene.pupil_radius = scene.focal_length / lens.f_number / 2;
  scene.fields_degrees = fields_of(lens.half_field_degrees, options.fields);
  scene.wavelengths = wavelengths_of(options.wavelengths);
  for (const std::string& group : groups) {
    if (std::count(options.optimize.begin(), options.optimize.end(), group) > 0)
      add_variables(scene, group);
  }
  scene.lens = refocused(lens, scene.fields_degrees, scene.wavelengths, scene.pupil_radius);
  measure_start(scene);
  return scene;
}

double& number_of(Lens& lens, const Variable& variable) {
  Surface& surface = lens.surfaces[variable.surface];
  if (variable.group == "curvatures") return surface.curvature;
  if (variable.group == "spacings") return surface.spacing;
  return variable.group == "indices" ? surface.index : surface.conic;
}

std::vector<double> start_of(const Scene& scene) {
  Lens lens = scene.lens;
  std::vector<double> x;
  for (const Variable& variable : scene.variables)
    x.push_back(number_of(lens, variable) / variable.scale);
  return x;
}

Lens lens_at(const Scene& scene, const std::vector<double>& x) {
  Lens lens = scene.lens;
  for (size_t n = 0; n < x.size(); ++n)
    number_of(lens, scene.variables[n]) = x[n] * scene.variables[n].scale;
  return lens;
}

std::vector<std::string> left_out(const Scene& scene) {
  std::vector<std::string> out;
  if (!scene.has_dispersion())
    out.push_back("dispersion and the dimension of wavelengths: there is one wavelength");
  size_t spheres = 0;
  for (size_t k = 0; k < scene.lens.surfaces.size(); ++k)
    spheres += !scene.lens.surfaces[k].stop && !scene.has_conic(k);
  if (spheres > 0)
    out.push_back(text("terms of conics of ", spheres, " surfaces: they are spheres"));
  if (!scene.has_rims()) out.push_back("vignetting: no surface has a rim");
  for (const std::string& group : groups) {
    const bool moves = std::any_of(scene.variables.begin(), scene.variables.end(),
                                   [&](const Variable& v) { return v.group == group; });
    if (!moves) out.push_back(text("derivatives by the ", group, ": they do not move"));
  }
  return out;
}

}  // namespace lens
