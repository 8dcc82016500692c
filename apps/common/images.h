// images.h -- photographs as interleaved floats, read and written through OpenImageIO.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace apps {

struct Image {
  int width = 0;
  int height = 0;
  int bits = 8;               // bits per sample in the file: 8, 16 or 32 (float)
  std::vector<float> pixels;  // [height, width, channels]; 1.0 is the brightest integer sample
  int channels = 3;

  long elems() const { return static_cast<long>(channels) * width * height; }
};

// Larger images are rejected: a step would need too much memory.
inline constexpr long max_pixels = 50'000'000;

// Reads any format, sample type and channel count that OpenImageIO decodes, including RAW photographs, as three
// channels. Gray is copied to all three; alpha is left out. Photographs are turned upright by their EXIF orientation;
// files from write_image have none. Throws retrograde::UserError if the file is missing, unreadable, truncated, empty
// or too large, or if a sample is not finite.
Image read_image(const std::filesystem::path& path);

// The same with the file's own channels, including alpha.
Image read_channels(const std::filesystem::path& path);

// The samples of a camera's sensor, one channel: a RAW file without demosaicing, or an image of one channel, not
// turned. `pattern` names the colours of the first two rows, as "RGGB"; empty if the file does not say. `orientation`:
// to be applied to the final picture by upright().
struct Mosaic {
  Image image;
  std::string pattern;
  int orientation = 1;
};
Mosaic read_mosaic(const std::filesystem::path& path);

// Turns and mirrors an image according to an EXIF orientation of 1 to 8; other values change nothing.
Image upright(Image image, int orientation);

// The images of a folder in the order of their names; other files are ignored. Throws retrograde::UserError if it is
// not a folder or contains no images.
std::vector<std::filesystem::path> images_in(const std::filesystem::path& folder);

// Resizes the image by a triangle filter whose width is a pixel of the coarser image (P. Heckbert, Fundamentals of
// Texture Mapping and Image Warping, 1989, section 3.5), with repeated edges.
Image resized(const Image& image, int width, int height);

// The suffix selects the format: .png with 8 bits per sample, or 16 if the image's source had more than 8 (clamped to
// [0, 1]); .exr, .tif, .tiff and .hdr as floats; .jpg with 8 bits. Throws retrograde::UserError; see write_file.
void write_image(const std::filesystem::path& path, const Image& image);

// Writes PNG whatever the suffix.
void write_png(const std::filesystem::path& path, const Image& image);

}  // namespace apps
