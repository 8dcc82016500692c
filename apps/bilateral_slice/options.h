// options.h -- the command line of bilateral_slice.
#pragma once

#include <filesystem>
#include <optional>

namespace bilateral_slice {

struct Options {
  std::filesystem::path input, output;
  std::filesystem::path target;  // empty: the built-in edit
  int steps = 200;
  int threads = 0;
  bool check_gradients = false;  // instead of learning
  double halide_seconds = 90;    // the peer stops after this long; 0 leaves it out
};

// Nothing when the command line asked only for help, which is then printed. Throws
// retrograde::UserError.
std::optional<Options> read_options(int argc, char** argv);

}  // namespace bilateral_slice
