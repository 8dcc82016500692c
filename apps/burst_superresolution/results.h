// results.h -- what a run leaves behind: pictures, homographies, the report with its plots.
#pragma once

#include "common/report.h"
#include "fit.h"

namespace burst {

struct Run {
  const Options& options;
  const Burst& burst;
  const Prepared& prepared;
  const Evaluator<float>& evaluator;
  const Fit& fit;
  double compile_seconds = 0;  // of the objective and its gradient

  // From the frames to the picture, compilers included.
  double total_seconds() const { return prepared.seconds + compile_seconds + fit.seconds; }
};

// result.png (and result.exr, linear light, where the frames were floats), what it is measured beside,
// homographies.json, report.json and its plots, in the output folder. Throws retrograde::UserError.
void write_results(const Run& run, apps::Report& report);

// The outcome in a few lines, on standard output.
void print_summary(const Run& run);

}  // namespace burst
