// report.h -- writes report.json.
#pragma once

#include <filesystem>

#include "fit.h"
#include "gradient_check.h"

namespace bilateral_slice {

// Peak signal-to-noise ratio for samples with peak 1, in dB; 200 for equal samples.
double psnr_db(double mean_squared_error);

struct Report {
  Shape shape;
  Groups moves;
  int threads = 0;
  double seconds = 0;  // the whole run, from reading the images to rendering the result
  double psnr_initial_db = 0;
  double psnr_final_db = 0;
  GradientCheck gradient_check;
  double peak_memory_mb = 0;
};

// Values that were not measured are null. Throws retrograde::UserError; see apps::write_file.
void write_report(const std::filesystem::path& path, const Report& report, const Fit& fit);

}  // namespace bilateral_slice
