// measure.h -- how good a method is on photographs that were blurred, and how long it takes.
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
  double mean_db = 0;                        // over photographs and functions
  std::vector<double> stages_db;             // the same after each stage
  std::vector<std::vector<double>> each_db;  // [photographs, functions]
  double seconds_per_megapixel = 0;
};

// The functions that methods are measured with: two paths of a shaken camera, two discs.
std::vector<Psf> usual_psfs();

// The middle of each photograph, in luma, blurred by each function.
class Gallery {
 public:
  // `side` pixels along each side, or as many as the smallest photograph has. Throws retrograde::UserError for
  // photographs that are smaller than a function.
  Gallery(const std::vector<demosaic::Photograph>& photographs, double noise, int side);

  const Extent& extent() const { return problems_.front().problem.extent; }
  const std::vector<std::string>& names() const { return names_; }
  double blurred_db() const;
  // Nothing when somebody stops it.
  std::optional<Measured> measure(Deconvolver& method) const;
  // What has the shape of the one before is not compiled again. When somebody stops it, those that were measured
  // by then.
  std::vector<Measured> measure(const std::vector<Method>& methods, int threads) const;

 private:
  std::vector<Simulated> problems_;  // one a photograph
  std::vector<std::string> names_;
};

inline constexpr int usual_side = 256;

apps::Table table_of(double blurred_db, const std::vector<Measured>& methods);
// One row a photograph and one a function: means of decibels.
apps::Table details_of(const Gallery& gallery, const std::vector<Measured>& methods);

}  // namespace deconvolution
