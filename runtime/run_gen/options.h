// options.h -- the command line of a program that runs one compiled function: name=value for its arguments, and flags.
// Names and meanings are those of Halide's RunGenMain.
#pragma once

#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace retrograde::run_gen {

// An error message for the user; the program then exits with status 1.
class Problem : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct Options {
  bool help = false, describe = false, quiet = false, verbose = false;
  bool parsable = false, track_memory = false, benchmark = false;
  double min_seconds = 0.1;  // of a benchmark
  std::string filter;        // --name: selects one of several registered functions
  std::optional<std::string> output_extents, default_buffers, default_scalars;
  std::map<std::string, std::string> values;  // values of arguments, by name
};

Options read_options(int argc, const char* const* argv);
std::string usage(const std::string& program);

std::vector<std::string> split(const std::string& text, char separator);
// "[3,4]"
std::vector<int> read_extents(const std::string& text);

}  // namespace retrograde::run_gen
