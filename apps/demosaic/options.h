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
  std::filesystem::path dataset;  // to learn from; empty: nothing is learned
  std::filesystem::path weights;  // of the relaxed method; empty: those that are shipped
  std::string pattern;  // not empty: the input is a mosaic, and these are its first colours
  Shape shape;
  bool compare = false;     // measure all methods on the dataset, learn nothing
  bool time_steps = false;  // with `compare`: how long a step of learning takes, by groups
  bool brief = false;       // leave out the shipped variants where something is measured
};

// Nothing when only --help was asked for. Throws retrograde::UserError.
std::optional<Options> read_options(int argc, char** argv);

}  // namespace demosaic
