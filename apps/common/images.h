// images.h -- photographs as interleaved floats, read and written through OpenImageIO.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace apps {

struct Image {
  int width = 0;
  int height = 0;
  int bits = 8;               // what the file stored per sample: 8, 16 or 32 (float)
  std::vector<float> pixels;  // [height, width, channels]; 1.0 is the brightest integer sample
  int channels = 3;

  long elems() const { return static_cast<long>(channels) * width * height; }
};

// Images larger than this are refused: a step would need more memory than it is worth.
inline constexpr long max_pixels = 50'000'000;

// Any format, sample type and channel count that OpenImageIO decodes, RAW photographs included, as
// three channels. Gray is spread over them; alpha is left out. A photograph is turned upright, as its
// EXIF orientation asks; what write_image writes has no orientation, and needs none. Throws retrograde::UserError when
// the file is missing, unreadable, truncated, empty or too large, or when a sample is not finite.
Image read_image(const std::filesystem::path& path);

// The same with the channels that the file has, alpha included.
Image read_channels(const std::filesystem::path& path);

// What a camera's sensor saw, one channel: a RAW file without demosaicing, or an image of one
// channel as it is, not turned. `pattern` names the colours of the first two rows, as "RGGB"; empty: the
// file does not say. `orientation`: how a picture made of it is to be turned, by upright().
struct Mosaic {
  Image image;
  std::string pattern;
  int orientation = 1;
};
Mosaic read_mosaic(const std::filesystem::path& path);

// An image as it is stored, turned and mirrored as an EXIF orientation of 1 to 8 says; others are none.
Image upright(Image image, int orientation);

// The images of a folder by their names' order; other files are left out. Throws
// retrograde::UserError when it is no folder or holds none.
std::vector<std::filesystem::path> images_in(const std::filesystem::path& folder);

// The image at another size: a triangle filter, as wide as a pixel of the coarser of the two (P. Heckbert,
// Fundamentals of Texture Mapping and Image Warping, 1989, section 3.5), edges repeated.
Image resized(const Image& image, int width, int height);

// By the suffix: .png with 8 bits a sample, or 16 when the image came with more than 8 (clamped to
// [0, 1]); .exr, .tif, .tiff and .hdr as floats, .jpg with 8 bits. Throws retrograde::UserError;
// see write_file.
void write_image(const std::filesystem::path& path, const Image& image);

// The same whatever the suffix. Kept for those who name their files themselves.
void write_png(const std::filesystem::path& path, const Image& image);

}  // namespace apps
