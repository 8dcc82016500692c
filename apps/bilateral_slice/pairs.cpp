// pairs.cpp -- see pairs.h.
#include "pairs.h"

#include <algorithm>
#include <string>

#include "diagnostics/error.h"
#include "tone_edit.h"

namespace bilateral_slice {

using retrograde::text;

namespace {

void require_same_size(const std::filesystem::path& photo, const std::filesystem::path& target,
                       const apps::Image& a, const apps::Image& b) {
  if (a.width == b.width && a.height == b.height) return;
  retrograde::call_error(
      text("learn how ", retrograde::quoted(photo.string()), " becomes ",
           retrograde::quoted(target.string())),
      "input and target must have the same size",
      text("they have ", a.width, " x ", a.height, " and ", b.width, " x ", b.height, " pixels"),
      "Resize or crop one of them");
}

apps::Image read_photo(const std::filesystem::path& path) {
  apps::Image image = read_gray_or_colour(path);
  if (image.width < 4 || image.height < 4) {
    retrograde::call_error(
        text("learn a look from ", retrograde::quoted(path.string())),
        "a grid is interpolated along both axes: a photo has at least 4 x 4 pixels",
        text("it has ", image.width, " x ", image.height), "Give a larger photo");
  }
  return image;
}

}  // namespace

// Images of one or two channels are gray (with alpha); of more channels, the first three are the colours.
apps::Image read_gray_or_colour(const std::filesystem::path& path) {
  const apps::Image stored = apps::read_channels(path);
  apps::Image image{stored.width, stored.height, stored.bits, {}, stored.channels < 3 ? 1 : 3};
  image.pixels.reserve(image.elems());
  for (long n = 0; n < stored.elems(); ++n) {
    if (n % stored.channels < image.channels) image.pixels.push_back(stored.pixels[n]);
  }
  return image;
}

Planes to_planes(const apps::Image& image, int channels, bool homogeneous) {
  const long pixels = static_cast<long>(image.width) * image.height;
  Planes planes((homogeneous ? channels + 1 : channels) * pixels, 1.0f);
  for (int c = 0; c < channels; ++c) {
    const int from = std::min(c, image.channels - 1);
    for (long p = 0; p < pixels; ++p)
      planes[c * pixels + p] = image.pixels[image.channels * p + from];
  }
  return planes;
}

apps::Image to_image(const Shape& shape, const Planes& planes, int bits) {
  apps::Image image{shape.width, shape.height, bits, {}, shape.channels};
  image.pixels.resize(image.elems());
  for (int c = 0; c < shape.channels; ++c) {
    for (long p = 0; p < shape.pixels(); ++p)
      image.pixels[shape.channels * p + c] = planes[c * shape.pixels() + p];
  }
  return image;
}

Pair read_pair(const std::filesystem::path& photo, const std::filesystem::path& target) {
  Pair pair;
  const apps::Image input = read_photo(photo);
  pair.shape = {.width = input.width, .height = input.height, .channels = input.channels};
  pair.bits = input.bits;
  if (target.empty()) {
    pair.photo = to_planes(input, input.channels, true);
    pair.target.resize(pair.shape.samples());
    tone_edit(pair.shape, pair.photo.data(), pair.target.data());
    return pair;
  }
  const apps::Image wanted = read_gray_or_colour(target);
  require_same_size(photo, target, input, wanted);
  pair.bits = std::max(input.bits, wanted.bits);
  pair.shape.channels = std::max(input.channels, wanted.channels);
  pair.photo = to_planes(input, pair.shape.channels, true);
  pair.target = to_planes(wanted, pair.shape.channels, false);
  return pair;
}

void make_colour(Pair& pair) {
  if (pair.shape.channels == 3) return;
  const apps::Image photo = to_image(pair.shape, pair.photo, pair.bits),
                    target = to_image(pair.shape, pair.target, pair.bits);
  pair.shape.channels = 3;
  pair.photo = to_planes(photo, 3, true);
  pair.target = to_planes(target, 3, false);
}

Pair resized(const Pair& pair, int width, int height) {
  Pair out = pair;
  out.shape.width = width;
  out.shape.height = height;
  const auto at_size = [&](const Planes& planes) {
    return apps::resized(to_image(pair.shape, planes, pair.bits), width, height);
  };
  out.photo = to_planes(at_size(pair.photo), pair.shape.channels, true);
  out.target = to_planes(at_size(pair.target), pair.shape.channels, false);
  return out;
}

double mean_squared_difference(const Planes& a, const Planes& b, long samples) {
  double sum = 0;
  for (long n = 0; n < samples; ++n) {
    const double d = static_cast<double>(a[n]) - b[n];
    sum += d * d;
  }
  return sum / static_cast<double>(samples);
}

}  // namespace bilateral_slice
