// options.h -- the command line.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "common/options.h"
#include "solver.h"

namespace deconvolution {

struct Options {
  apps::CommonOptions common;
  std::filesystem::path dataset;  // photographs to learn from, and to be measured on
  std::filesystem::path weights;  // instead of those that are shipped; where learning starts
  std::string psf = "motion:19:1";
  double noise = usual_noise;
  bool blurred = false;  // the input is: there is no truth
  bool compare = false;  // measure what is shipped, learn nothing
  bool brief = false;    // leave out what comes with the program, but for the original method
  bool tune = false;     // scan the numbers of the original method
  int iterations = 30;   // of a stage, at most
  Shape shape{.filters = 16, .size = 5, .bumps = 7};  // to be learned
  int stages = 4;
};

// Nothing when only --help was asked for. Throws retrograde::UserError.
std::optional<Options> read_options(int argc, char** argv);

}  // namespace deconvolution
