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
  std::filesystem::path dataset;  // photographs for learning and measuring
  std::filesystem::path
      weights;  // replaces the shipped weights; also the initial point of learning
  std::string psf = "motion:19:1";
  double noise = usual_noise;
  bool blurred = false;  // the input is blurred already: there is no truth
  bool compare = false;  // measure the shipped methods, learn nothing
  bool brief = false;    // leave out the shipped methods except the original one
  bool tune = false;     // tune the numbers of the original method by a scan
  int iterations = 30;   // per stage, at most
  Shape shape{.filters = 16, .size = 5, .bumps = 7};  // of the weights to learn
  int stages = 4;
};

// Nothing if only --help was requested. Throws retrograde::UserError.
std::optional<Options> read_options(int argc, char** argv);

}  // namespace deconvolution
