// measure.h -- how good a method is on photographs, and how long it takes; all methods on one plot.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "common/report.h"
#include "demosaicker.h"
#include "photographs.h"

namespace demosaic {

struct Measured {
  std::string name;
  Quality mean;  // of the photographs, in decibels
  std::vector<Quality> each;
  double ms_per_megapixel = 0;
};

// What was published for the Kodak photographs, which are others than these.
struct Published {
  const char* name;
  double encoded_db;
};
std::span<const Published> published();

// Each with a mosaic, made once.
class Gallery {
 public:
  explicit Gallery(const std::vector<Photograph>& photographs);

  // Without times.
  Measured quality_of(Demosaicker& method);
  // With the time for a mosaic of a megapixel, which repeats the photographs.
  Measured measure(Demosaicker& method);

 private:
  const std::vector<Photograph>& photographs_;
  std::vector<std::vector<float>> mosaics_;
  std::vector<float> large_;
};

// Bilinear, AHD and, unless `brief`, every variant that comes with the program.
std::vector<Measured> measure_methods(Gallery& gallery, int threads, bool brief);

apps::Table table_of(const std::vector<Measured>& methods);
apps::Plot plot_of(const std::vector<Measured>& methods);

}  // namespace demosaic
