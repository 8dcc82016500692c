// options.h -- the command line.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "common/options.h"
#include "relaxed.h"

namespace demosaic {

struct Options {
  apps::CommonOptions common;
  std::filesystem::path dataset;  // photographs to learn from; empty: nothing is learned
  std::filesystem::path weights;  // of the relaxed method; empty: the shipped ones
  std::string pattern;  // if not empty, the input is a mosaic whose first colours are these
  Shape shape;
  bool compare = false;     // measure all methods on the dataset, learn nothing
  bool time_steps = false;  // with `compare`: measure the time of a learning step, by groups
  bool brief = false;       // leave out the shipped variants in measurements
};

// Nothing if only --help was requested. Throws retrograde::UserError.
std::optional<Options> read_options(int argc, char** argv);

}  // namespace demosaic
