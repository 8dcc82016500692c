#include "one_picture.h"

#include <algorithm>
#include <cctype>
#include <cmath>

#include "common/images.h"
#include "demosaicker.h"
#include "diagnostics/error.h"
#include "photographs.h"

namespace demosaic {

using retrograde::quoted;
using retrograde::text;

namespace {

// A mosaic that begins with red: others get a mirrored column, row or both put before them.
struct Sensor {
  int width = 0, height = 0, bits = 16;
  int left = 0, top = 0;       // what was put before
  std::vector<float> samples;  // in sRGB's encoding
};

bool is_raw(const std::filesystem::path& path) {
  static const std::vector<std::string> suffixes{".dng", ".cr2", ".cr3", ".nef", ".arw",
                                                 ".orf", ".raf", ".rw2", ".pef", ".srw"};
  std::string suffix = path.extension().string();
  for (char& c : suffix) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return std::find(suffixes.begin(), suffixes.end(), suffix) != suffixes.end();
}

Sensor begin_with_red(const apps::Image& mosaic, const std::string& pattern, bool is_light) {
  const int left = pattern[0] == 'G' ? (pattern[1] == 'R' ? 1 : 0) : (pattern[0] == 'B' ? 1 : 0);
  const int top = pattern[0] == 'G' ? (pattern[1] == 'R' ? 0 : 1) : (pattern[0] == 'B' ? 1 : 0);
  Sensor sensor{mosaic.width + left, mosaic.height + top, mosaic.bits, left, top, {}};
  for (int y = 0; y < sensor.height; ++y) {
    for (int x = 0; x < sensor.width; ++x) {
      const auto from = static_cast<size_t>(mirrored(y - top, mosaic.height)) *
                            static_cast<size_t>(mosaic.width) +
                        static_cast<size_t>(mirrored(x - left, mosaic.width));
      const float value = mosaic.pixels[from];
      sensor.samples.push_back(is_light ? encoded(value) : std::clamp(value, 0.0f, 1.0f));
    }
  }
  return sensor;
}

Sensor read_sensor(const Options& options) {
  const auto& path = options.common.input;
  const apps::Mosaic mosaic = apps::read_mosaic(path);
  const std::string pattern = options.pattern.empty() ? mosaic.pattern : options.pattern;
  const std::string colours = "RGGB GRBG GBRG BGGR";
  if (pattern.size() != 4 || colours.find(pattern) == std::string::npos) {
    retrograde::call_error(text("demosaic ", quoted(path.string())),
                           "a mosaic begins with RGGB, GRBG, GBRG or BGGR",
                           pattern.empty() ? std::string("the file does not say with which")
                                           : text("the file says ", quoted(pattern)),
                           "Give --mosaic with the colours of its first two rows");
  }
  if (mosaic.image.width < 2 || mosaic.image.height < 2) {
    retrograde::call_error(
        text("demosaic ", quoted(path.string())), "a mosaic needs a whole cell, 2 x 2 samples",
        text("it has ", mosaic.image.width, " x ", mosaic.image.height), "Give a larger one");
  }
  // What a sensor measures is linear in light.
  return begin_with_red(mosaic.image, pattern, is_raw(path) || mosaic.image.bits == 32);
}

void write_planes(const Options& options, const std::string& name, const Sensor& size,
                  std::span<const float> planes) {
  apps::write_image(options.common.output / name,
                    image_of(size.width, size.height, size.bits, planes));
}

// A picture of floats holds linear light, as it came.
void write_light(const Options& options, const Sensor& size, std::vector<float> planes) {
  if (size.bits < 32) return;
  for (float& value : planes) value = decoded(value);
  write_planes(options, "result.exr", size, planes);
}

// Without what begin_with_red put before.
void write_result(const Options& options, const Sensor& sensor, const std::vector<float>& planes) {
  Sensor size = sensor;
  size.width -= sensor.left;
  size.height -= sensor.top;
  std::vector<float> cut;
  for (int c = 0; c < 3; ++c) {
    for (int y = sensor.top; y < sensor.height; ++y) {
      const auto row = planes.begin() + (static_cast<long>(c) * sensor.height + y) * sensor.width;
      cut.insert(cut.end(), row + sensor.left, row + sensor.width);
    }
  }
  write_planes(options, "result.png", size, cut);
  write_light(options, size, cut);
}

void demosaic_mosaic(const Options& options, const Weights& weights, apps::Report& report) {
  Sensor sensor = read_sensor(options);
  Demosaicker method = Demosaicker::relaxed(weights, options.common.threads);
  const auto planes = method.run(sensor.samples, sensor.width, sensor.height);
  write_result(options, sensor, planes);
  report.add_picture("result.png", method.name());
  report.own["width"] = sensor.width - sensor.left;
  report.own["height"] = sensor.height - sensor.top;
}

// The mosaic in its colours, as a picture.
std::vector<float> coloured(const Photograph& photograph) {
  std::vector<float> planes(photograph.planes.size(), 0.0f);
  for (int y = 0; y < photograph.height; ++y) {
    for (int x = 0; x < photograph.width; ++x) {
      const int c = colour_at(x, y);
      const auto place = static_cast<size_t>(c) * photograph.pixels() +
                         static_cast<size_t>(y) * static_cast<size_t>(photograph.width) +
                         static_cast<size_t>(x);
      planes[place] = photograph.planes[place];
    }
  }
  return planes;
}

void demosaic_picture(const Options& options, const Weights& weights, apps::Report& report) {
  const Photograph photograph = read_photograph(options.common.input);
  const Sensor size{photograph.width, photograph.height, photograph.bits, 0, 0, {}};
  auto mosaic = mosaic_of(photograph);
  write_planes(options, "truth.png", size, photograph.planes);
  write_planes(options, "mosaic.png", size, coloured(photograph));
  report.add_picture("truth.png", "the picture");
  report.add_picture("mosaic.png", "what a sensor sees of it");
  const int threads = options.common.threads;
  Demosaicker bilinear = Demosaicker::bilinear(threads), ahd = Demosaicker::ahd(threads),
              relaxed = Demosaicker::relaxed(weights, threads);
  double before = 0;
  for (const auto& [method, file] :
       {std::pair{&bilinear, "bilinear.png"}, {&ahd, "ahd.png"}, {&relaxed, "result.png"}}) {
    const auto planes = method->run(mosaic, photograph.width, photograph.height);
    write_planes(options, file, size, planes);
    const Quality q = quality(photograph, planes);
    report.add_picture(file,
                       text(method->name(), ", ", std::round(100 * q.encoded_db) / 100, " dB"));
    report.own["picture"][method->name()] = {{"psnr_srgb_db", q.encoded_db},
                                             {"psnr_linear_db", q.linear_db}};
    if (method == &ahd) before = q.encoded_db;
    if (method != &relaxed) continue;
    write_light(options, size, planes);
    report.add_number("PSNR of the picture", q.encoded_db, "dB", before);
  }
  report.own["width"] = photograph.width;
  report.own["height"] = photograph.height;
}

}  // namespace

void demosaic_input(const Options& options, const Weights& weights, apps::Report& report) {
  if (!options.pattern.empty() || is_raw(options.common.input)) {
    demosaic_mosaic(options, weights, report);
  } else {
    demosaic_picture(options, weights, report);
  }
}

}  // namespace demosaic
