// options.h -- the command line of bilateral_slice.
#pragma once

#include <filesystem>
#include <optional>

#include "common/options.h"
#include "groups.h"

namespace bilateral_slice {

struct Options : apps::CommonOptions {
  std::filesystem::path target;  // empty: the built-in edit
  std::filesystem::path pairs;   // a folder from which to learn one look
  std::filesystem::path apply;   // a learned look to apply to --input
  std::filesystem::path start;   // the initial look; empty: the identity
  Groups moves;
  int grid = 0;                // nodes along each side of the photo; 0: 64, or 3 for many photos
  double halide_seconds = 90;  // time limit of the peer; 0: no peer
  int check_side = 0;          // pixels along the crop of --check-gradients; 0: 96 x 80
  bool time_steps = false;     // instead of training: measure the time of a step, by moving groups
};

// Nothing if the command line only requested help, which is then printed. Throws retrograde::UserError.
std::optional<Options> read_options(int argc, char** argv);

}  // namespace bilateral_slice
