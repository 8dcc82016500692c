// measure.cpp -- see measure.h.
#include "measure.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <numeric>
#include <utility>

#include "common/stop.h"
#include "diagnostics/error.h"

namespace deconvolution {

namespace {

constexpr uint64_t noise_seed = 1;
constexpr int least_side = 16;

nlohmann::json cell(double value, const char* format = "%.2f") {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), format, value);
  return text.data();
}

double mean(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

int common_side(const std::vector<demosaic::Photograph>& photographs, int side, int margin) {
  for (const auto& p : photographs) {
    const int most = std::min(p.width, p.height) - 2 * margin;
    if (most < least_side) {
      retrograde::call_error(
          retrograde::text("measure on ", retrograde::quoted(p.name)),
          retrograde::text("a photograph has ", least_side + 2 * margin, " pixels along each side"),
          retrograde::text("it has ", p.width, " x ", p.height), "Give larger photographs");
    }
    side = std::min(side, most);
  }
  return side;
}

}  // namespace

std::vector<Psf> usual_psfs() {
  std::vector<Psf> psfs{motion_path(19, 1), motion_path(15, 2), defocus_disc(3), defocus_disc(5)};
  int largest = 0;
  for (const Psf& psf : psfs) largest = std::max(largest, psf.size);
  for (Psf& psf : psfs) psf = enlarged(psf, largest);
  return psfs;
}

Gallery::Gallery(const std::vector<demosaic::Photograph>& photographs, double noise, int side) {
  const std::vector<Psf> psfs = usual_psfs();
  const int margin = psfs.front().size / 2;
  const int full = common_side(photographs, side, margin) + 2 * margin;
  Random random(noise_seed);
  for (const auto& photograph : photographs) {
    const Plane luma = luma_of(photograph);
    const Plane part = luma.part((luma.width - full) / 2, (luma.height - full) / 2, full, full);
    Simulated simulated;
    for (const Psf& psf : psfs) simulated.add(part, psf, noise, random);
    problems_.push_back(std::move(simulated));
    names_.push_back(photograph.name);
  }
}

double Gallery::blurred_db() const {
  double sum = 0;
  for (const Simulated& s : problems_) sum += mean(each_psnr_db(s.problem.blurred, s));
  return sum / static_cast<double>(problems_.size());
}

std::optional<Measured> Gallery::measure(Deconvolver& method) const {
  const auto goes_on = [](int, const lang::Buffer<float>&) { return !apps::stop_requested(); };
  Measured result{method.name(), 0, {}, {}, 0};
  const auto count = static_cast<double>(problems_.size());
  const auto begin = std::chrono::steady_clock::now();
  for (const Simulated& s : problems_) {
    const std::vector<float> images = method.run(s.problem, goes_on);
    if (method.stopped()) return std::nullopt;
    result.each_db.push_back(each_psnr_db(images, s));
    result.mean_db += mean(result.each_db.back()) / count;
    const auto& stages = method.stages();
    result.stages_db.resize(stages.size(), 0.0);
    for (size_t k = 0; k < stages.size(); ++k)
      result.stages_db[k] += mean(each_psnr_db(stages[k], s)) / count;
  }
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  result.seconds_per_megapixel =
      seconds * 1e6 / (count * static_cast<double>(extent().seen_elems()));
  return result;
}

std::vector<Measured> Gallery::measure(const std::vector<Method>& methods, int threads) const {
  std::vector<Measured> measured;
  std::optional<Deconvolver> deconvolver;
  for (const Method& method : methods) {
    if (apps::stop_requested()) break;
    if (deconvolver && deconvolver->shape() == method.weights.shape) {
      deconvolver->use(method);
    } else {
      deconvolver.emplace(method, extent(), threads);
    }
    std::optional<Measured> one = measure(*deconvolver);
    if (!one) break;
    measured.push_back(*std::move(one));
  }
  return measured;
}

apps::Table table_of(double blurred_db, const std::vector<Measured>& methods) {
  apps::Table table{
      "photographs that were blurred",
      {"method", "PSNR [dB]", "over the original [dB]", "after each stage [dB]", "s per megapixel"},
      {}};
  table.rows.push_back({"blurred", cell(blurred_db), "-", "-", "-"});
  for (const Measured& m : methods) {
    std::string stages;
    for (const double db : m.stages_db)
      stages += (stages.empty() ? "" : ", ") + cell(db).get<std::string>();
    table.rows.push_back({m.name, cell(m.mean_db),
                          cell(m.mean_db - methods.front().mean_db, "%+.2f"), stages,
                          cell(m.seconds_per_megapixel)});
  }
  return table;
}

apps::Table details_of(const Gallery& gallery, const std::vector<Measured>& methods) {
  apps::Table table{"each photograph and function", {"mean over the others"}, {}};
  for (const Measured& m : methods) table.head.push_back(m.name + " [dB]");
  const auto psfs = usual_psfs();
  for (size_t p = 0; p < gallery.names().size(); ++p) {
    std::vector<nlohmann::json> row{gallery.names()[p]};
    for (const Measured& m : methods) row.push_back(cell(mean(m.each_db[p])));
    table.rows.push_back(row);
  }
  for (size_t k = 0; k < psfs.size(); ++k) {
    std::vector<nlohmann::json> row{psfs[k].name};
    for (const Measured& m : methods) {
      double sum = 0;
      for (const auto& of : m.each_db) sum += of[k];
      row.push_back(cell(sum / static_cast<double>(m.each_db.size())));
    }
    table.rows.push_back(row);
  }
  return table;
}

}  // namespace deconvolution
