// measure.h -- measures the quality of methods on photographs and their run time, and plots all methods.
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
  Quality mean;  // mean over the photographs, in decibels
  std::vector<Quality> each;
  double ms_per_megapixel = 0;
};

// Published values for the Kodak photographs, which are not the photographs used here.
struct Published {
  const char* name;
  double encoded_db;
};
std::span<const Published> published();

// Photographs with their mosaics, which are made once.
class Gallery {
 public:
  explicit Gallery(const std::vector<Photograph>& photographs);

  // Measures quality only.
  Measured quality_of(Demosaicker& method);
  // Also measures the time for a mosaic of a megapixel, which repeats the photographs.
  Measured measure(Demosaicker& method);

 private:
  const std::vector<Photograph>& photographs_;
  std::vector<std::vector<float>> mosaics_;
  std::vector<float> large_;
};

// Measures bilinear, AHD and, unless `brief`, every variant that comes with the program.
std::vector<Measured> measure_methods(Gallery& gallery, int threads, bool brief);

apps::Table table_of(const std::vector<Measured>& methods);
apps::Plot plot_of(const std::vector<Measured>& methods);

}  // namespace demosaic
