// scene.h -- the optimization problem: a lens, the rays that judge it, and the numbers that are optimized.
#pragma once

#include <string>
#include <vector>

#include "prescription.h"

namespace lens {

// The groups for --optimize.
inline const std::vector<std::string> groups = {"curvatures", "spacings", "indices", "conics"};

// One number of the lens. The optimizer sees it in units of `scale`, chosen so that a step of 1 changes the image about
// equally for all numbers.
struct Variable {
  std::string group;
  size_t surface = 0;
  double scale = 1;
};

struct Scene {
  Lens lens;                           // the initial lens
  std::vector<double> fields_degrees;  // three or four over the field
  std::vector<double> wavelengths;     // um
  std::vector<Variable> variables;
  double focal_length = 0;    // mm; must be kept
  double pupil_radius = 0;    // mm: focal length over twice the F-number
  int rings = 4, spokes = 6;  // rays per field and wavelength
  // Values of the initial lens by the pipeline's rays; the loss is relative to them.
  double spot_square = 1;     // mm^2, mean over the fields
  std::vector<double> light;  // per field

  // Features of the compiled code; features that are absent add no code.
  bool has_dispersion() const { return wavelengths.size() > 1; }
  bool has_conic(size_t surface) const;
  bool has_rims() const;
};

struct SceneOptions {
  std::vector<std::string> optimize = {"curvatures", "spacings"};
  int fields = 4;
  int wavelengths = 3;  // 1: d; 2: F, C; 3: F, d, C
};

// Refocuses the lens and makes it the initial one. Throws retrograde::UserError if a group contains no number, or if no
// light arrives.
Scene make_scene(const Lens& lens, const SceneOptions& options);

std::vector<double> start_of(const Scene& scene);  // in the optimizer's units
Lens lens_at(const Scene& scene, const std::vector<double>& x);

// The number that a variable refers to, in millimetres or other natural units.
double& number_of(Lens& lens, const Variable& variable);

// Features that the compiled code leaves out because the scene does not use them, one line each.
std::vector<std::string> left_out(const Scene& scene);

}  // namespace lens
