// arguments.h -- the command line of gpu_check, and its exit statuses.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace device_check {

constexpr int problems_found = 1, wrong_arguments = 2, no_device = 77;

struct Arguments {
  std::string output, python = "python3";
  double seconds = -1;  // -1: the default, also for `random`
  int random = -1;
  uint64_t first_seed = 1;
  bool is_simulated = false;
  std::vector<std::string> only;
  // Arguments for a worker, which this program starts itself.
  std::string worker, file;
  int capability = 75;
};

// Prints the problem and the usage, and exits.
[[noreturn]] void usage(const std::string& problem);

Arguments arguments_of(int argc, char** argv);

}  // namespace device_check
