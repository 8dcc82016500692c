// options.h -- the command line of fluid.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "common/minimize.h"
#include "common/options.h"
#include "scene.h"

namespace fluid {

struct Options {
  apps::CommonOptions common;
  std::filesystem::path start;       // empty: a disc
  std::filesystem::path force_from;  // the state of another run; empty: none
  int frames = 40;
  int cells = 0;         // along the longer side; 0: the picture's pixels
  int force_nodes = 16;  // along the longer side; 0: one per cell
  Physics physics;
  double swirl = 0, reach = 0.2, effort = 1e-5, rate = 0.1;
  Solver solver = Solver::Direct;
  int iterations = 40;
  std::vector<apps::Method> methods;
};

// Nothing if the command line only requested help, which is then printed. Throws retrograde::UserError.
std::optional<Options> read_options(int argc, char** argv);

}  // namespace fluid
