// smoke.cpp -- see smoke.h.
#include "smoke.h"

#include <OpenImageIO/imageio.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <memory>
#include <numbers>
#include <numeric>

#include "common/files.h"
#include "diagnostics/error.h"

namespace fluid {

using retrograde::quoted;
using retrograde::text;

namespace {

constexpr int smallest_side = 4;

Smoke luminance_of(const apps::Image& image) {
  Smoke smoke{image.width, image.height, {}};
  smoke.density.resize(static_cast<size_t>(image.width) * image.height);
  for (size_t n = 0; n < smoke.density.size(); ++n) {
    const float* p = image.pixels.data() + 3 * n;
    smoke.density[n] = 0.2126f * p[0] + 0.7152f * p[1] + 0.0722f * p[2];  // ITU-R BT.709
  }
  return smoke;
}

void require_cells(const std::filesystem::path& path, int width, int height) {
  if (width >= smallest_side && height >= smallest_side) return;
  retrograde::call_error(text("simulate smoke in the shape of ", quoted(path.string())),
                         text("a box has at least ", smallest_side, " x ", smallest_side, " cells"),
                         text("this one would have ", width, " x ", height),
                         "Give a larger picture, or more --cells");
}

// The mean over [from, to), in samples, along a row or column.
float mean_between(const float* values, size_t stride, int size, double from, double to) {
  double sum = 0;
  for (int n = static_cast<int>(from); n < std::min<double>(size, std::ceil(to)); ++n) {
    sum += values[n * stride] * (std::min(to, n + 1.0) - std::max<double>(from, n));
  }
  return static_cast<float>(sum / (to - from));
}

}  // namespace

double Smoke::total() const { return std::accumulate(density.begin(), density.end(), 0.0); }

Smoke resample(const Smoke& smoke, int width, int height) {
  if (smoke.width == width && smoke.height == height) return smoke;
  Smoke rows{width, smoke.height, std::vector<float>(static_cast<size_t>(width) * smoke.height)};
  const double across = static_cast<double>(smoke.width) / width,
               down = static_cast<double>(smoke.height) / height;
  for (int y = 0; y < smoke.height; ++y) {
    for (int x = 0; x < width; ++x) {
      rows.density[static_cast<size_t>(y) * width + x] =
          mean_between(smoke.density.data() + static_cast<size_t>(y) * smoke.width, 1, smoke.width,
                       x * across, (x + 1) * across);
    }
  }
  Smoke result{width, height, std::vector<float>(static_cast<size_t>(width) * height)};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      result.density[static_cast<size_t>(y) * width + x] =
          mean_between(rows.density.data() + x, width, smoke.height, y * down, (y + 1) * down);
    }
  }
  return result;
}

Smoke read_smoke(const std::filesystem::path& path) { return luminance_of(apps::read_image(path)); }

Cells cells_for(const Smoke& picture, int longer, const std::filesystem::path& path) {
  const double scale =
      longer == 0 ? 1 : static_cast<double>(longer) / std::max(picture.width, picture.height);
  const Cells cells{static_cast<int>(std::lround(picture.width * scale)),
                    static_cast<int>(std::lround(picture.height * scale))};
  require_cells(path, cells.width, cells.height);
  return cells;
}

Smoke read_smoke_like(const std::filesystem::path& path, const Smoke& other) {
  const Smoke smoke = read_smoke(path);
  // Checks that the shapes are the same, up to rounding of a side.
  if (std::abs(smoke.width * static_cast<double>(other.height) / other.width - smoke.height) > 1) {
    retrograde::call_error(text("start from ", quoted(path.string())),
                           "the smoke at the start fills the same box as the picture of the end",
                           text("it has ", smoke.width, " x ", smoke.height, " pixels, the box ",
                                other.width, " x ", other.height, " cells"),
                           "Resize or crop one of them");
  }
  return resample(smoke, other.width, other.height);
}

Smoke disc_like(const Smoke& other) {
  const double largest = std::min(other.width, other.height) / 2.0 - 1,
               radius = std::min(std::sqrt(other.total() / std::numbers::pi), largest);
  Smoke disc = other;
  for (int y = 0; y < disc.height; ++y) {
    for (int x = 0; x < disc.width; ++x) {
      const double from_middle =
          std::hypot(x + 0.5 - disc.width / 2.0, y + 0.5 - disc.height / 2.0);
      disc.density[static_cast<size_t>(y) * disc.width + x] =
          static_cast<float>(std::clamp(radius - from_middle + 0.5, 0.0, 1.0));
    }
  }
  const double factor = other.total() / disc.total();
  for (float& d : disc.density) d = static_cast<float>(d * factor);
  return disc;
}

apps::Image to_image(const Smoke& smoke, int zoom) {
  apps::Image image{smoke.width * zoom, smoke.height * zoom, 8, {}, 3};
  image.pixels.resize(image.elems());
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const float d = smoke.density[static_cast<size_t>(y / zoom) * smoke.width + x / zoom];
      std::fill_n(image.pixels.data() + 3 * (static_cast<size_t>(y) * image.width + x), 3,
                  std::clamp(d, 0.0f, 1.0f));
    }
  }
  return image;
}

apps::Image strip_of(const std::vector<apps::Image>& images) {
  constexpr int gap = 4;
  const apps::Image& first = images.front();
  const int count = static_cast<int>(images.size());
  apps::Image strip{count * (first.width + gap) - gap, first.height, 8, {}, 3};
  strip.pixels.assign(strip.elems(), 0.5f);
  for (int n = 0; n < count; ++n) {
    for (int y = 0; y < first.height; ++y) {
      std::copy_n(images[n].pixels.data() + 3 * static_cast<size_t>(y) * first.width,
                  3 * first.width,
                  strip.pixels.data() +
                      3 * (static_cast<size_t>(y) * strip.width + n * (first.width + gap)));
    }
  }
  return strip;
}

struct Animation::Encoder {
  std::string scratch;
  std::unique_ptr<OIIO::ImageOutput> output;
  int images, frames_a_second, added = 0;
};

void Animation::refuse(const std::string& evidence) const {
  retrograde::call_error("write an animation",
                         "it is encoded by OpenImageIO in a folder for temporary files", evidence,
                         "Free some space there");
}

Animation::Animation(int images, int frames_a_second) : encoder_(new Encoder) {
  encoder_->images = images;
  encoder_->frames_a_second = frames_a_second;
  encoder_->scratch = (std::filesystem::temp_directory_path() / "smoke.XXXXXX.gif").string();
  const int file = ::mkstemps(encoder_->scratch.data(), 4);
  if (file < 0) refuse("no file can be made there");
  ::close(file);
  encoder_->output = OIIO::ImageOutput::create(encoder_->scratch);
  if (!encoder_->output) refuse(OIIO::geterror());
}

Animation::~Animation() {
  encoder_->output.reset();
  ::unlink(encoder_->scratch.c_str());
}

void Animation::add(const apps::Image& image) {
  Encoder& e = *encoder_;
  OIIO::ImageSpec spec(image.width, image.height, 3, OIIO::TypeDesc::UINT8);
  spec.attribute("FramesPerSecond", static_cast<float>(e.frames_a_second));
  const std::vector<OIIO::ImageSpec> specs(e.images, spec);
  const bool open = e.added == 0
                        ? e.output->open(e.scratch, e.images, specs.data())
                        : e.output->open(e.scratch, spec, OIIO::ImageOutput::AppendSubimage);
  ++e.added;
  if (!open || !e.output->write_image(OIIO::TypeDesc::FLOAT, image.pixels.data())) {
    refuse(e.output->geterror());
  }
}

void Animation::finish(const std::filesystem::path& path) {
  if (!encoder_->output->close()) refuse(encoder_->output->geterror());
  std::ifstream written(encoder_->scratch, std::ios::binary);
  apps::write_file(path, std::string{std::istreambuf_iterator<char>(written), {}});
}

}  // namespace fluid
