// options.h -- the command line of bilateral_slice.
#pragma once

#include <filesystem>
#include <optional>

#include "common/options.h"
#include "groups.h"

namespace bilateral_slice {

struct Options : apps::CommonOptions {
  std::filesystem::path target;  // empty: the built-in edit
  std::filesystem::path pairs;   // a folder to learn one look from
  std::filesystem::path apply;   // a look that was learned, for --input
  std::filesystem::path start;   // a look to begin with; empty: the identity
  Groups moves;
  int grid = 0;                // nodes along each side of the photo; 0: 64, or 3 for many photos
  double halide_seconds = 90;  // the peer stops after this long; 0 leaves it out
  int check_side = 0;          // pixels along the crop of --check-gradients; 0: 96 x 80
  bool time_steps = false;     // instead of learning: how long a step takes, by what moves
};

// Nothing when the command line asked only for help, which is then printed. Throws
// retrograde::UserError.
std::optional<Options> read_options(int argc, char** argv);

}  // namespace bilateral_slice
