// pictures.cpp -- see pictures.h.
#include "pictures.h"

#include <algorithm>
#include <cmath>

#include "common/images.h"
#include "demosaic/photographs.h"

namespace burst {

namespace {

size_t at(const FrameSize& size, int x, int y, size_t c) {
  return c * size.pixels() + static_cast<size_t>(y) * static_cast<size_t>(size.width) +
         static_cast<size_t>(x);
}

// A square of the planes, turned upright.
apps::Image square_of(std::span<const float> planes, const FrameSize& size, const Corner& corner,
                      int side, int orientation) {
  apps::Image square{side, side, 8, {}};
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      for (size_t c = 0; c < 3; ++c)
        square.pixels.push_back(planes[at(size, corner.x + x, corner.y + y, c)]);
    }
  }
  return apps::upright(std::move(square), orientation);
}

double activity(std::span<const float> planes, const FrameSize& size, const Corner& from,
                int side) {
  double sum = 0;
  for (int y = from.y; y + 1 < from.y + side; ++y) {
    for (int x = from.x; x + 1 < from.x + side; ++x) {
      const float here = planes[at(size, x, y, 1)];
      sum += std::abs(planes[at(size, x + 1, y, 1)] - here) +
             std::abs(planes[at(size, x, y + 1, 1)] - here);
    }
  }
  return sum;
}

}  // namespace

void write_planes(const std::filesystem::path& path, std::span<const float> planes,
                  const FrameSize& size, int bits, int orientation) {
  apps::write_image(
      path, apps::upright(demosaic::image_of(size.width, size.height, bits, planes), orientation));
}

std::vector<float> coloured(std::span<const float> mosaic, const FrameSize& size) {
  std::vector<float> planes(3 * size.pixels(), 0.0f);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      planes[at(size, x, y, static_cast<size_t>(demosaic::colour_at(x, y)))] =
          mosaic[at(size, x, y, 0)];
    }
  }
  return planes;
}

Corner busiest_square(std::span<const float> planes, const FrameSize& size, int side) {
  Corner best{0, 0};
  double most = -1;
  const int step = std::max(side / 2, 1);
  for (int y = 0; y + side <= size.height; y += step) {
    for (int x = 0; x + side <= size.width; x += step) {
      const double own = activity(planes, size, {x, y}, side);
      if (own <= most) continue;
      most = own;
      best = {x, y};
    }
  }
  return best;
}

void write_enlarged(const std::filesystem::path& path,
                    std::span<const std::span<const float>> pictures, const FrameSize& size,
                    const Corner& corner, int side, int times, int orientation) {
  const int panel = side * times, gap = times;
  apps::Image image{static_cast<int>(pictures.size()) * (panel + gap) - gap, panel, 8, {}};
  image.pixels.assign(static_cast<size_t>(image.elems()), 1.0f);
  for (size_t n = 0; n < pictures.size(); ++n) {
    const apps::Image square = square_of(pictures[n], size, corner, side, orientation);
    for (int y = 0; y < panel; ++y) {
      for (int x = 0; x < panel; ++x) {
        const size_t to = (static_cast<size_t>(y) * static_cast<size_t>(image.width) +
                           n * static_cast<size_t>(panel + gap) + static_cast<size_t>(x)) *
                          3;
        const auto from = static_cast<size_t>(y / times * side + x / times) * 3;
        for (size_t c = 0; c < 3; ++c) image.pixels[to + c] = square.pixels[from + c];
      }
    }
  }
  apps::write_image(path, image);
}

}  // namespace burst
