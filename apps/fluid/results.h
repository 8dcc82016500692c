// results.h -- writes a run's results to its folder: pictures, the animation, report.json.
#pragma once

#include <string>
#include <vector>

#include "common/report.h"
#include "control.h"
#include "fit.h"
#include "memory_plan.h"
#include "smoke.h"

namespace fluid {

// Measurements before the optimization.
struct Setup {
  double compile_seconds = 0;
  double difference = 0;  // mean squared difference from the picture without any force
  MemoryPlan memory;
  std::vector<std::string> left_out;
};

// Writes frames/0000.png ..., animation.gif, strip.png, start.png, target.png and result.png, then the report, which
// was begun with the run, and its plot. Throws retrograde::UserError.
struct Results {
  double psnr_before_db, psnr_db, loss, seconds_a_frame, seconds_a_gradient;
};
Results write_results(const Options& options, Control<float>& control, const Fit& fit,
                      const Setup& setup, apps::Report& report);

double psnr_db(double mean_squared_difference);

}  // namespace fluid
