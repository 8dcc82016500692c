// reference_trace.h -- a reference ray tracer in plain C++ and double. It is the oracle for the pipeline and computes
// spots and drawings. It has no smooth transitions: a ray either arrives or not.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "prescription.h"

namespace lens {

using Point = std::array<double, 3>;

enum class Fate { Arrived, Missed, Vignetted, TotallyReflected };

struct TracedRay {
  Fate fate = Fate::Arrived;
  std::vector<Point>
      path;  // intersections with each surface and the image; z from the first vertex
  // At the image; only valid if the ray arrived.
  double x() const { return path.back()[0]; }
  double y() const { return path.back()[1]; }
};

// Traces a ray with a field angle through a point (in units of its radius) of the entrance pupil: the paraxial pupil at
// line d with radius `pupil_radius`.
TracedRay trace_ray(const Lens& lens, double field_degrees, double pupil_x, double pupil_y,
                    double pupil_radius, double wavelength);

// Points of the pupil's right half with weights that sum to 1: Gauss' rule over the squared radius (G. Forbes, JOSA A
// 5, 1988, p. 1943, eq. 6), and the midpoint rule over the angle.
struct PupilPoint {
  double x, y, weight;
};
std::vector<PupilPoint> pupil_points(int rings, int spokes);

// Quality measures of an image.
struct SpotField {
  double degrees = 0;
  double rms = 0;       // mm, about the centroid of all wavelengths
  double centroid = 0;  // mm
  double light = 0;     // share of the rays that arrived, from 0 to 1
};
struct SpotReport {
  std::vector<SpotField> fields;
  double mean_rms = 0;  // over the fields
  double mean_light = 0;
};
SpotReport spots(const Lens& lens, const std::vector<double>& fields_degrees,
                 const std::vector<double>& wavelengths, double pupil_radius, int rings = 12,
                 int spokes = 24);

// Moves the image plane to where the mean spot is smallest.
Lens refocused(const Lens& lens, const std::vector<double>& fields_degrees,
               const std::vector<double>& wavelengths, double pupil_radius);

}  // namespace lens
