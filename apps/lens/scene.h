// scene.h -- what is optimized: a lens, the light that it is judged by, and which of its numbers may move.
#pragma once

#include <string>
#include <vector>

#include "prescription.h"

namespace lens {

// What --optimize names.
inline const std::vector<std::string> groups = {"curvatures", "spacings", "indices", "conics"};

// One number of the lens. The optimizer sees it in units of `scale`, in which a step of 1 changes the
// image about as much for all of them.
struct Variable {
  std::string group;
  size_t surface = 0;
  double scale = 1;
};

struct Scene {
  Lens lens;                           // as it is at the start
  std::vector<double> fields_degrees;  // three or four over the field
  std::vector<double> wavelengths;     // um
  std::vector<Variable> variables;
  double focal_length = 0;    // mm, to be kept
  double pupil_radius = 0;    // mm: focal length over twice the F-number
  int rings = 4, spokes = 6;  // rays of a field and wavelength
  // Of the start, by the rays of the pipeline: what the loss is relative to.
  double spot_square = 1;     // mm^2, mean over the fields
  std::vector<double> light;  // of each field

  // What the compiled code has. What is false leaves no trace in it.
  bool has_dispersion() const { return wavelengths.size() > 1; }
  bool has_conic(size_t surface) const;
  bool has_rims() const;
};

struct SceneOptions {
  std::vector<std::string> optimize = {"curvatures", "spacings"};
  int fields = 4;
  int wavelengths = 3;  // 1: d; 2: F, C; 3: F, d, C
};

// The lens at its best focus becomes the start. Throws retrograde::UserError when a group has nothing
// to move or no light arrives.
Scene make_scene(const Lens& lens, const SceneOptions& options);

std::vector<double> start_of(const Scene& scene);  // in the units of the optimizer
Lens lens_at(const Scene& scene, const std::vector<double>& x);

// The number that a variable stands for, in millimetres and the like.
double& number_of(Lens& lens, const Variable& variable);

// What the compiled code leaves out because the scene does not use it, a line each.
std::vector<std::string> left_out(const Scene& scene);

}  // namespace lens
