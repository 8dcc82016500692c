// measure.h -- measures a method's quality on artificially blurred photographs, and its run time.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/report.h"
#include "deconvolver.h"
#include "simulation.h"

namespace deconvolution {

struct Measured {
  std::string name;
  double mean_db = 0;                        // over photographs and blur functions
  std::vector<double> stages_db;             // mean after each stage
  std::vector<std::vector<double>> each_db;  // [photographs, functions]
  double seconds_per_megapixel = 0;
};

// The blur functions of measurements: two paths of a shaken camera, two discs.
std::vector<Psf> usual_psfs();

// The central part of each photograph, in luma, blurred by each function.
class Gallery {
 public:
  // `side` pixels along each side, or as many as the smallest photograph has. Throws retrograde::UserError if a
  // photograph is smaller than a function.
  Gallery(const std::vector<demosaic::Photograph>& photographs, double noise, int side);

  const Extent& extent() const { return problems_.front().problem.extent; }
  const std::vector<std::string>& names() const { return names_; }
  double blurred_db() const;
  // Nothing if it is stopped.
  std::optional<Measured> measure(Deconvolver& method) const;
  // A method with the shape of the previous one is not compiled again. If it is stopped, returns the methods measured
  // so far.
  std::vector<Measured> measure(const std::vector<Method>& methods, int threads) const;

 private:
  std::vector<Simulated> problems_;  // one per photograph
  std::vector<std::string> names_;
};

inline constexpr int usual_side = 256;

apps::Table table_of(double blurred_db, const std::vector<Measured>& methods);
// One row per photograph and one per function, with means in decibels.
apps::Table details_of(const Gallery& gallery, const std::vector<Measured>& methods);

}  // namespace deconvolution
