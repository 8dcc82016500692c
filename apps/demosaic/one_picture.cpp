#include "one_picture.h"

#include <cmath>

#include "common/images.h"
#include "demosaicker.h"
#include "diagnostics/error.h"
#include "photographs.h"
#include "sensor.h"

namespace demosaic {

using retrograde::text;

namespace {

apps::Image write_planes(const Options& options, const std::string& name, const Sensor& size,
                         std::span<const float> planes) {
  const apps::Image image =
      apps::upright(image_of(size.width, size.height, size.bits, planes), size.orientation);
  apps::write_image(options.common.output / name, image);
  return image;
}

// Float pictures are written as linear light, like the input.
void write_light(const Options& options, const Sensor& size, std::vector<float> planes) {
  if (size.bits < 32) return;
  for (float& value : planes) value = decoded(value);
  write_planes(options, "result.exr", size, planes);
}

// Writes the picture without the rows and columns that begin_with_red added.
apps::Image write_result(const Options& options, const Sensor& sensor,
                         const std::vector<float>& planes) {
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
  write_light(options, size, cut);
  return write_planes(options, "result.png", size, cut);
}

void demosaic_mosaic(const Options& options, const Weights& weights, apps::Report& report) {
  Sensor sensor = read_sensor(options.common.input, options.pattern);
  Demosaicker method = Demosaicker::relaxed(weights, options.common.threads);
  const auto planes = method.run(sensor.samples, sensor.width, sensor.height);
  const apps::Image result = write_result(options, sensor, planes);
  report.add_picture("result.png", method.name());
  report.own["width"] = result.width;
  report.own["height"] = result.height;
}

// The mosaic with each sample in its colour, as a picture.
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
  const Sensor size{photograph.width, photograph.height, photograph.bits, 0, 0, {}, 1};
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
