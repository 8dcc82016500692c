// homography.cpp -- see homography.h.
#include "homography.h"

#include <algorithm>
#include <cmath>

namespace burst {

namespace {

constexpr int grid_nodes = 17;

Matrix product(const Matrix& a, const Matrix& b) {
  Matrix out{};
  for (size_t row = 0; row < 3; ++row) {
    for (size_t column = 0; column < 3; ++column) {
      for (size_t k = 0; k < 3; ++k) out[3 * row + column] += a[3 * row + k] * b[3 * k + column];
    }
  }
  return out;
}

// The inverse up to a factor, by cofactors without the determinant: homographies have no scale.
Matrix adjugate(const Matrix& m) {
  return {m[4] * m[8] - m[5] * m[7], m[2] * m[7] - m[1] * m[8], m[1] * m[5] - m[2] * m[4],
          m[5] * m[6] - m[3] * m[8], m[0] * m[8] - m[2] * m[6], m[2] * m[3] - m[0] * m[5],
          m[3] * m[7] - m[4] * m[6], m[1] * m[6] - m[0] * m[7], m[0] * m[4] - m[1] * m[3]};
}

// The matrix from (u, v) to pixels.
Matrix to_pixels(const FrameSize& size) {
  const double s = size.scale();
  return {s, 0, size.centre_x(), 0, s, size.centre_y(), 0, 0, 1};
}

Matrix to_units(const FrameSize& size) {
  const double s = size.scale();
  return {1 / s, 0, -size.centre_x() / s, 0, 1 / s, -size.centre_y() / s, 0, 0, 1};
}

Matrix in_units(const Homography& h) {
  return {1 + h[0], h[1], h[2], h[3], 1 + h[4], h[5], h[6], h[7], 1};
}

std::array<Place, 4> corners(const FrameSize& size) {
  const double right = size.width - 1, bottom = size.height - 1;
  return {{{0, 0}, {right, 0}, {right, bottom}, {0, bottom}}};
}

// The area of a polygon given by its corners in order; negative if it is mirrored.
double area(const std::array<Place, 4>& p) {
  double twice = 0;
  for (size_t n = 0; n < 4; ++n) {
    const Place &a = p[n], &b = p[(n + 1) % 4];
    twice += a.x * b.y - b.x * a.y;
  }
  return twice / 2;
}

}  // namespace

double depth_at(const Homography& h, const FrameSize& size, double x, double y) {
  const double u = (x - size.centre_x()) / size.scale(), v = (y - size.centre_y()) / size.scale();
  return 1 + h[6] * u + h[7] * v;
}

Place place_of(const Homography& h, const FrameSize& size, double x, double y) {
  const double s = size.scale();
  const double u = (x - size.centre_x()) / s, v = (y - size.centre_y()) / s;
  const double tilt = h[6] * u + h[7] * v;
  return {x + s * (h[0] * u + h[1] * v + h[2] - u * tilt) / (1 + tilt),
          y + s * (h[3] * u + h[4] * v + h[5] - v * tilt) / (1 + tilt)};
}

Matrix matrix_of(const Homography& h, const FrameSize& size) {
  Matrix m = product(product(to_pixels(size), in_units(h)), to_units(size));
  const double last = m[8];
  if (last != 0) {
    for (double& value : m) value /= last;
  }
  return m;
}

Homography homography_of(const Matrix& matrix, const FrameSize& size) {
  Matrix m = product(product(to_units(size), matrix), to_pixels(size));
  const double last = m[8];
  for (double& value : m) value /= last;
  return {m[0] - 1, m[1], m[2], m[3], m[4] - 1, m[5], m[6], m[7]};
}

Homography inverse(const Homography& h, const FrameSize& size) {
  return homography_of(adjugate(matrix_of(h, size)), size);
}

bool is_small_motion(const Homography& h, const FrameSize& size) {
  std::array<Place, 4> moved{};
  const auto still = corners(size);
  for (size_t n = 0; n < 4; ++n) {
    const double depth = depth_at(h, size, still[n].x, still[n].y);
    if (!(depth >= 0.5 && depth <= 2)) return false;
    moved[n] = place_of(h, size, still[n].x, still[n].y);
  }
  const double ratio = area(moved) / area(still);
  return ratio >= 0.5 && ratio <= 2;
}

MotionError motion_error(const Homography& found, const Homography& truth, const FrameSize& size) {
  MotionError error;
  for (int row = 0; row < grid_nodes; ++row) {
    for (int column = 0; column < grid_nodes; ++column) {
      const double x = column * (size.width - 1.0) / (grid_nodes - 1);
      const double y = row * (size.height - 1.0) / (grid_nodes - 1);
      const Place a = place_of(found, size, x, y), b = place_of(truth, size, x, y);
      const double distance = std::hypot(a.x - b.x, a.y - b.y);
      error.mean += distance / (grid_nodes * grid_nodes);
      error.worst = std::max(error.worst, distance);
    }
  }
  return error;
}

MotionError motion_error(std::span<const Homography> found, std::span<const Homography> truth,
                         const FrameSize& size) {
  MotionError all;
  const size_t moved = found.size() - 1;
  for (size_t n = 1; n < found.size(); ++n) {
    const MotionError one = motion_error(found[n], truth[n], size);
    all.mean += one.mean / static_cast<double>(moved);
    all.worst = std::max(all.worst, one.worst);
  }
  return all;
}

}  // namespace burst
