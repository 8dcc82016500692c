// options.h -- the command line of burst_superresolution.
#pragma once

#include <optional>
#include <string>

#include "common/options.h"
#include "evaluator.h"
#include "noise.h"
#include "simulation.h"

namespace burst {

struct Options {
  apps::CommonOptions common;
  Moves moves;            // as --optimize says
  Simulation simulation;  // of a photograph; its seed is the common one
  std::string pattern;    // of images of one channel in a folder
  Colours colours = Colours::Rgb;
  std::optional<double> lambda;  // weight of the first colour; else by the noise
  bool write_frames = false;
};

// Nothing when only --help was asked for. Throws retrograde::UserError.
std::optional<Options> read_options(int argc, char** argv);

}  // namespace burst
