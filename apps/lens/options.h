// options.h -- the command line of lens.
#pragma once

#include <optional>

#include "common/options.h"

namespace lens {

struct Options {
  apps::CommonOptions common;
  std::string method = "lbfgs";
  bool compare = false;  // also run the other methods, for the plot
  double shorter_percent = 10;
  int wavelengths = 3, fields = 4, stages = 5, restarts = 0;
};

// Nothing if the command line only requested help, which is then printed. Throws retrograde::UserError.
std::optional<Options> read_options(int argc, char** argv);

}  // namespace lens
