#include "measure.h"

#include <array>
#include <cmath>
#include <cstdio>

#include "shipped.h"

namespace demosaic {

namespace {

constexpr int large_side = 1024, timed_runs = 9;

nlohmann::json cell(double value, const char* format) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), format, value);
  return text.data();
}

}  // namespace

std::span<const Published> published() {
  static constexpr std::array<Published, 4> list{{{"bilinear", 32.9},
                                                  {"AHD", 36.1},
                                                  {"relaxed AHD, least", 36.7},
                                                  {"relaxed AHD, most", 37.3}}};
  return list;
}

Gallery::Gallery(const std::vector<Photograph>& photographs) : photographs_(photographs) {
  for (const Photograph& photograph : photographs) mosaics_.push_back(mosaic_of(photograph));
  const Photograph& first = photographs.front();
  for (int y = 0; y < large_side; ++y) {
    for (int x = 0; x < large_side; ++x) {
      large_.push_back(
          first.at(mirrored(x, first.width), mirrored(y, first.height), colour_at(x, y)));
    }
  }
}

Measured Gallery::quality_of(Demosaicker& method) {
  Measured result{method.name(), {}, {}, 0};
  const auto count = static_cast<double>(photographs_.size());
  for (size_t n = 0; n < photographs_.size(); ++n) {
    const Photograph& truth = photographs_[n];
    const Quality q = quality(truth, method.run(mosaics_[n], truth.width, truth.height));
    result.each.push_back(q);
    result.mean.encoded_db += q.encoded_db / count;
    result.mean.linear_db += q.linear_db / count;
  }
  return result;
}

Measured Gallery::measure(Demosaicker& method) {
  Measured result = quality_of(method);
  result.ms_per_megapixel = method.ms_per_megapixel(large_, large_side, large_side, timed_runs);
  return result;
}

std::vector<Measured> measure_methods(Gallery& gallery, int threads, bool brief) {
  std::vector<Measured> methods;
  Demosaicker bilinear = Demosaicker::bilinear(threads), ahd = Demosaicker::ahd(threads);
  methods.push_back(gallery.measure(bilinear));
  methods.push_back(gallery.measure(ahd));
  if (brief) return methods;
  for (const Shape& shape : shipped_shapes()) {
    Demosaicker relaxed = Demosaicker::relaxed(shipped_weights(shape), threads);
    methods.push_back(gallery.measure(relaxed));
  }
  return methods;
}

apps::Table table_of(const std::vector<Measured>& methods) {
  apps::Table table{"held-out photographs",
                    {"method", "PSNR sRGB [dB]", "PSNR linear [dB]", "ms per megapixel"},
                    {}};
  for (const Measured& m : methods) {
    table.rows.push_back({m.name, cell(m.mean.encoded_db, "%.2f"), cell(m.mean.linear_db, "%.2f"),
                          cell(m.ms_per_megapixel, "%.2f")});
  }
  for (const Published& p : published()) {
    table.rows.push_back(
        {std::string("published, Kodak: ") + p.name, cell(p.encoded_db, "%.1f"), "-", "-"});
  }
  return table;
}

apps::Plot plot_of(const std::vector<Measured>& methods) {
  apps::Plot plot{.file = "quality_vs_time.png",
                  .title = "held-out photographs (points); published for others, Kodak's (lines)",
                  .x_label = "ms per megapixel",
                  .y_label = "PSNR [dB]"};
  plot.log_x = true;
  apps::PlotSeries encoded{"sRGB", {}, {}}, linear{"linear light", {}, {}};
  double least = 1e9, most = 0;
  for (const Measured& m : methods) {
    for (apps::PlotSeries* series : {&encoded, &linear}) {
      series->x.push_back(m.ms_per_megapixel);
      series->labels.push_back(m.name);
    }
    encoded.y.push_back(m.mean.encoded_db);
    linear.y.push_back(m.mean.linear_db);
    least = std::min(least, m.ms_per_megapixel);
    most = std::max(most, m.ms_per_megapixel);
  }
  plot.series = {encoded, linear};
  for (const Published& p : published()) {
    plot.series.push_back(
        {std::string("published (Kodak): ") + p.name, {least, most}, {p.encoded_db, p.encoded_db}});
  }
  return plot;
}

}  // namespace demosaic
