// results.h -- writes the results of a run: pictures, homographies, the report with its plots.
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

  // From the frames to the picture, including compile times.
  double total_seconds() const { return prepared.seconds + compile_seconds + fit.seconds; }
};

// Writes to the output folder: result.png (and result.exr, linear light, if the frames were floats), the baselines'
// pictures, homographies.json, report.json and its plots. Throws retrograde::UserError.
void write_results(const Run& run, apps::Report& report);

// Prints the outcome in a few lines to standard output.
void print_summary(const Run& run);

}  // namespace burst
