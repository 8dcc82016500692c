// reference_trace.cpp -- see reference_trace.h.
//
// It deliberately uses other methods than the pipeline: Newton's method finds the intersection with a surface from its
// equation, and refraction is Snell's law on vectors.
#include "reference_trace.h"

#include <cmath>
#include <numbers>

#include "paraxial.h"

namespace lens {

namespace {

using std::numbers::pi;

double dot(const Point& a, const Point& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

Point moved(const Point& from, double length, const Point& along) {
  return {from[0] + length * along[0], from[1] + length * along[1], from[2] + length * along[2]};
}

// c (x^2 + y^2 + (1 + k) z^2) - 2 z, and its gradient, which points against the light.
double surface_value(const Surface& s, const Point& p) {
  return s.curvature * (p[0] * p[0] + p[1] * p[1] + (1 + s.conic) * p[2] * p[2]) - 2 * p[2];
}
Point surface_gradient(const Surface& s, const Point& p) {
  return {2 * s.curvature * p[0], 2 * s.curvature * p[1],
          2 * s.curvature * (1 + s.conic) * p[2] - 2};
}

// The intersection of the ray with the sheet of the surface that contains the vertex.
std::optional<Point> meet(const Surface& s, const Point& from, const Point& along) {
  Point at = moved(from, -from[2] / along[2], along);
  for (int n = 0; n < 50; ++n) {
    const double value = surface_value(s, at), slope = dot(surface_gradient(s, at), along);
    if (!(slope < 0)) return std::nullopt;  // the ray left the sheet
    at = moved(at, -value / slope, along);
    if (std::abs(value / slope) < 1e-13) return at;
  }
  return std::nullopt;
}

// Takes unit vectors; `normal` points against the light. Nothing if the ray is totally reflected.
std::optional<Point> refracted(const Point& along, const Point& normal, double ratio) {
  const double cosine = -dot(along, normal);
  const double inside = 1 - ratio * ratio * (1 - cosine * cosine);
  if (inside < 0) return std::nullopt;
  const double turn = ratio * cosine - std::sqrt(inside);
  return Point{ratio * along[0] + turn * normal[0], ratio * along[1] + turn * normal[1],
               ratio * along[2] + turn * normal[2]};
}

Point unit(Point p) {
  const double length = std::sqrt(dot(p, p));
  for (double& v : p) v /= length;
  return p;
}

// Zeros of Legendre's polynomial on [-1, 1], by Newton's method from the usual initial guess, with their weights.
std::vector<std::pair<double, double>> gauss_rule(int points) {
  std::vector<std::pair<double, double>> rule;
  for (int n = 0; n < points; ++n) {
    double x = std::cos(pi * (n + 0.75) / (points + 0.5)), slope = 1;
    for (int step = 0; step < 60; ++step) {
      double before = 1, value = x;
      for (int k = 2; k <= points; ++k) {
        const double next = ((2 * k - 1) * x * value - (k - 1) * before) / k;
        before = value;
        value = next;
      }
      slope = points * (x * value - before) / (x * x - 1);
      x -= value / slope;
    }
    rule.emplace_back(x, 2 / ((1 - x * x) * slope * slope));
  }
  return rule;
}

struct Sums {
  double weight = 0, y = 0, square = 0;  // square: x^2 + y^2
};

SpotField spot_of_field(const Lens& lens, double degrees, const std::vector<double>& wavelengths,
                        double pupil_radius, const std::vector<PupilPoint>& points) {
  Sums sums;
  for (const double wavelength : wavelengths) {
    for (const PupilPoint& p : points) {
      const TracedRay ray = trace_ray(lens, degrees, p.x, p.y, pupil_radius, wavelength);
      if (ray.fate != Fate::Arrived) continue;
      sums.weight += p.weight;
      sums.y += p.weight * ray.y();
      sums.square += p.weight * (ray.x() * ray.x() + ray.y() * ray.y());
    }
  }
  SpotField field{.degrees = degrees};
  field.light = sums.weight / static_cast<double>(wavelengths.size());
  if (sums.weight == 0) return field;
  field.centroid = sums.y / sums.weight;
  // The left half of the pupil mirrors the right half, so the mean x is 0.
  field.rms = std::sqrt(std::max(sums.square / sums.weight - field.centroid * field.centroid, 0.0));
  return field;
}

}  // namespace

TracedRay trace_ray(const Lens& lens, double field_degrees, double pupil_x, double pupil_y,
                    double pupil_radius, double wavelength) {
  TracedRay ray;
  const double angle = field_degrees * pi / 180, place = paraxial(lens).pupil_place;
  Point along{0, std::sin(angle), std::cos(angle)};
  Point at{pupil_x * pupil_radius, pupil_y * pupil_radius, place};
  double vertex = 0, before = 1;
  for (size_t k = 0; k < lens.surfaces.size(); ++k) {
    const Surface& surface = lens.surfaces[k];
    at[2] -= vertex;
    const auto met = meet(surface, at, along);
    if (!met) {
      ray.fate = Fate::Missed;
      return ray;
    }
    at = *met;
    const double rim = surface.semi_aperture;
    if (rim > 0 && at[0] * at[0] + at[1] * at[1] > rim * rim) {
      ray.fate = Fate::Vignetted;
      return ray;
    }
    const double after = lens.index(k, wavelength);
    const auto turned = refracted(along, unit(surface_gradient(surface, at)), before / after);
    if (!turned) {
      ray.fate = Fate::TotallyReflected;
      return ray;
    }
    along = *turned;
    before = after;
    at[2] += vertex;
    ray.path.push_back(at);
    vertex += surface.spacing;
  }
  ray.path.push_back(moved(at, (vertex - at[2]) / along[2], along));
  return ray;
}

std::vector<PupilPoint> pupil_points(int rings, int spokes) {
  std::vector<PupilPoint> points;
  for (const auto& [x, weight] : gauss_rule(rings)) {
    const double radius = std::sqrt((1 + x) / 2);
    for (int s = 0; s < spokes; ++s) {
      const double angle = pi * ((s + 0.5) / spokes - 0.5);
      points.push_back({radius * std::cos(angle), radius * std::sin(angle), weight / 2 / spokes});
    }
  }
  return points;
}

SpotReport spots(const Lens& lens, const std::vector<double>& fields_degrees,
                 const std::vector<double>& wavelengths, double pupil_radius, int rings,
                 int spokes) {
  SpotReport report;
  const auto points = pupil_points(rings, spokes);
  for (const double degrees : fields_degrees) {
    report.fields.push_back(spot_of_field(lens, degrees, wavelengths, pupil_radius, points));
    report.mean_rms += report.fields.back().rms / static_cast<double>(fields_degrees.size());
    report.mean_light += report.fields.back().light / static_cast<double>(fields_degrees.size());
  }
  return report;
}

Lens refocused(const Lens& lens, const std::vector<double>& fields_degrees,
               const std::vector<double>& wavelengths, double pupil_radius) {
  Lens at = lens;
  double& back = at.surfaces.back().spacing;
  const double middle = back;
  const auto mean = [&](double place) {
    back = place;
    return spots(at, fields_degrees, wavelengths, pupil_radius, 6, 12).mean_rms;
  };
  // Golden-section search, over 5 % of the distance on both sides.
  const double golden = (std::sqrt(5.0) - 1) / 2;
  double low = 0.95 * middle, high = 1.05 * middle;
  while (high - low > 1e-5 * middle) {
    const double a = high - golden * (high - low), b = low + golden * (high - low);
    if (mean(a) < mean(b))
      high = b;
    else
      low = a;
  }
  back = (low + high) / 2;
  return at;
}

}  // namespace lens
