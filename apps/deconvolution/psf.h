// psf.h -- point-spread functions: the image of a point under a camera that shakes or is out of focus.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace deconvolution {

// [size, size] with odd size; no negative elements, and sum 1.
struct Psf {
  std::string name;
  int size = 1;
  std::vector<float> samples{1.0f};

  float at(int x, int y) const { return samples[static_cast<size_t>(y * size + x)]; }
};

inline constexpr int most_psf_size = 101;

// A disc of this radius in pixels; each sample is the area that the disc covers of it.
Psf defocus_disc(double radius);

// The path of a shaken camera during the exposure, centred on its mean. It is a point whose velocity is damped and
// pushed at random, with occasional jerks; the path is scaled to fit `size` samples and blurred slightly by the lens.
// The result depends only on size and seed.
Psf motion_path(int size, uint64_t seed);

// The brightness of an image file. Even sizes get one more row and column of zeros; of larger images only the part that
// is not zero is used. Throws retrograde::UserError if it is not a point-spread function.
Psf read_psf(const std::filesystem::path& path);

// "disc:RADIUS", "motion:SIZE" or "motion:SIZE:SEED", or a file. Throws retrograde::UserError.
Psf psf_of(const std::string& description);

// The function centred in a larger square of odd size; unchanged if it has that size.
Psf enlarged(const Psf& psf, int size);
Psf mirrored(const Psf& psf, bool flip_x, bool flip_y, bool turned);

}  // namespace deconvolution
