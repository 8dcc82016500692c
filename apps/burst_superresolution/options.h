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
  Moves moves;            // from --optimize
  Simulation simulation;  // for a photograph as input; its seed is the common one
  std::string pattern;    // mosaic pattern for one-channel images in a folder
  Colours colours = Colours::Rgb;
  std::optional<double> lambda;  // weight of the first colour; default: chosen from the noise
  bool write_frames = false;
};

// Nothing if only --help was requested. Throws retrograde::UserError.
std::optional<Options> read_options(int argc, char** argv);

}  // namespace burst
