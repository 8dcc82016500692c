// prescription.h -- a lens as a list of surfaces, read from and written to JSON.
//
// Light travels from the left, along z. A surface is a conic of revolution with its vertex on the axis,
//
//   c (x^2 + y^2 + (1 + k) z^2) - 2 z = 0,    c: curvature, k: conic constant (0: a sphere)
//
// followed by `spacing` millimetres of a medium whose index follows Cauchy's formula,
//
//   n(w) = index + dispersion (1 / w^2 - 1 / w_d^2),    w in micrometres, w_d: the helium line d
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace lens {

inline constexpr double line_F = 0.486133, line_d = 0.587562, line_D = 0.589294, line_C = 0.656273;

struct Surface {
  double curvature = 0;  // 1 / mm
  double conic = 0;
  double spacing = 0;        // mm, to the next surface or the image
  double index = 1;          // of the medium behind it, at line d
  double dispersion = 0;     // um^2
  double semi_aperture = 0;  // mm; 0: no rim
  bool stop = false;         // the diaphragm: a plane in air that refracts nothing
};

struct Lens {
  std::string name, source;
  double f_number = 8;
  double half_field_degrees = 20;
  std::vector<Surface> surfaces;

  size_t stop() const;                                    // index of the surface
  double length() const;                                  // mm, from the first vertex to the image
  double index(size_t surface, double wavelength) const;  // behind the surface
};

// The term of Cauchy's formula that dispersion multiplies.
double cauchy_term(double wavelength);

// Throws retrograde::UserError if the file is missing or not a prescription, or if the lens is impossible: see
// check_lens. If the last spacing is missing, it is that of the paraxial image.
Lens read_lens(const std::filesystem::path& path);
nlohmann::json to_json(const Lens& lens);

// Checks that surfaces are in order, within reach of each other and of possible media, and that they form an image.
// `asked` begins the message. Throws retrograde::UserError.
void check_lens(const Lens& lens, const std::string& asked);

// The distance of a surface from its vertex plane at height h; NaN beyond its equator.
double sag(const Surface& surface, double h);

}  // namespace lens
