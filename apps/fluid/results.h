// results.h -- what a run leaves in its folder: pictures, the animation, report.json.
#pragma once

#include <string>
#include <vector>

#include "common/report.h"
#include "control.h"
#include "fit.h"
#include "memory_plan.h"
#include "smoke.h"

namespace fluid {

// What was measured before the optimization.
struct Setup {
  double compile_seconds = 0;
  double difference = 0;  // of the smoke that nobody pushed from the picture, mean squared
  MemoryPlan memory;
  std::vector<std::string> left_out;
};

// frames/0000.png ..., animation.gif, strip.png, start.png, target.png and result.png, then the
// report, which began with the run, with its plot. Throws retrograde::UserError.
struct Results {
  double psnr_before_db, psnr_db, loss, seconds_a_frame, seconds_a_gradient;
};
Results write_results(const Options& options, Control<float>& control, const Fit& fit,
                      const Setup& setup, apps::Report& report);

double psnr_db(double mean_squared_difference);

}  // namespace fluid
