// homography.h -- maps a frame to the picture: a homography with eight parameters about the frame's centre.
//
//   u = (x - cx) / s,  v = (y - cy) / s,      (cx, cy): the centre of the frame, s: half of its longer side
//   w = 1 + h6 u + h7 v
//   x' = x + s (h0 u + h1 v + h2 - u (h6 u + h7 v)) / w
//   y' = y + s (h3 u + h4 v + h5 - v (h6 u + h7 v)) / w
//
// This is the matrix [1 + h0, h1, h2; h3, 1 + h4, h5; h6, h7, 1] in the units (u, v), written as a shift. All zeros are
// the identity, exactly in any precision. A change of any parameter by 1e-4 moves the frame's border by about 1e-4 s
// pixels, so one rate suits all eight.
// border by about s 1e-4 pixels, so that one rate suits all eight.
#pragma once

#include <array>
#include <span>
#include <vector>

namespace burst {

// The size of a frame in pixels.
struct FrameSize {
  int width = 0, height = 0;

  double centre_x() const { return (width - 1) / 2.0; }
  double centre_y() const { return (height - 1) / 2.0; }
  double scale() const { return (width > height ? width : height) / 2.0; }
  size_t pixels() const { return static_cast<size_t>(width) * static_cast<size_t>(height); }
};

inline constexpr int homography_params = 8;
using Homography = std::array<double, homography_params>;
// Row-major, for homogeneous pixel coordinates.
using Matrix = std::array<double, 9>;

struct Place {
  double x, y;
};

// Points with a smaller w are behind the camera, or too far away to be useful.
inline constexpr double least_depth = 0.05;

double depth_at(const Homography& h, const FrameSize& size, double x, double y);  // w
// The position of the frame's pixel (x, y) in the picture. The depth there must not be 0.
Place place_of(const Homography& h, const FrameSize& size, double x, double y);

Matrix matrix_of(const Homography& h, const FrameSize& size);
// The parameters of a matrix whose depth at the centre is not 0.
Homography homography_of(const Matrix& matrix, const FrameSize& size);
// The homography from the picture to the frame. `h` must be invertible.
Homography inverse(const Homography& h, const FrameSize& size);

// Whether the motion is plausible for a shaking camera: the depth of every corner is between half and twice that of the
// centre, and the frame is not mirrored and between half and twice as large.
bool is_small_motion(const Homography& h, const FrameSize& size);

// The distance of the frame's pixels from their true positions, in pixels, over a regular grid of 17 x 17.
struct MotionError {
  double mean = 0, worst = 0;
};
MotionError motion_error(const Homography& found, const Homography& truth, const FrameSize& size);
// Over all frames except the first, which defines the picture.
MotionError motion_error(std::span<const Homography> found, std::span<const Homography> truth,
                         const FrameSize& size);

}  // namespace burst
