// psf.h -- point-spread functions: what a camera makes of a point that shakes or is out of focus.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace deconvolution {

// [size, size], size odd, nothing negative, of sum 1.
struct Psf {
  std::string name;
  int size = 1;
  std::vector<float> samples{1.0f};

  float at(int x, int y) const { return samples[static_cast<size_t>(y * size + x)]; }
};

inline constexpr int most_psf_size = 101;

// A disc of this radius in pixels, each sample as much as the disc covers of it.
Psf defocus_disc(double radius);

// The path of a shaken camera while its shutter is open, centred on its mean: a point whose velocity is pulled
// back to rest and pushed at random, with now and then a jerk, scaled to fit `size` samples, and blurred
// a little by the lens. The seed alone decides.
Psf motion_path(int size, uint64_t seed);

// An image file's brightness. Even sizes get a row and a column of zeros more; of a larger one only the part
// that is not zero is taken. Throws retrograde::UserError for what is no point-spread function.
Psf read_psf(const std::filesystem::path& path);

// "disc:RADIUS", "motion:SIZE" or "motion:SIZE:SEED", or a file. Throws retrograde::UserError.
Psf psf_of(const std::string& description);

// The same in the middle of a larger square, of odd size; as it is where it is as large.
Psf enlarged(const Psf& psf, int size);
Psf mirrored(const Psf& psf, bool flip_x, bool flip_y, bool turned);

}  // namespace deconvolution
