// options.h -- the command line of bench_kernels.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace bench {

struct Options {
  std::vector<std::string> kernels;  // to run, including gradients
  bool quick = false;                // few runs of each; the numbers are only rough
  int rounds = 31;
  std::filesystem::path output = "kernels.json";
};

const std::vector<std::string>& kernel_names();    // of forward pipelines
const std::vector<std::string>& gradient_names();  // of gradients
bool is_gradient(const std::string& name);

// Nothing if only help was requested. Throws retrograde::UserError.
std::optional<Options> read_options(int argc, char** argv);

}  // namespace bench
