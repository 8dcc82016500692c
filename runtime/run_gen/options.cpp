#include "run_gen/options.h"

#include <charconv>

namespace retrograde::run_gen {

namespace {

bool read_switch(const std::string& flag, const std::string& value) {
  if (value.empty() || value == "true" || value == "1") return true;
  if (value == "false" || value == "0") return false;
  throw Problem("--" + flag + " must be true or false, not \"" + value + "\"");
}

double read_seconds(const std::string& value) {
  try {
    size_t used = 0;
    const double seconds = std::stod(value, &used);
    if (used == value.size() && seconds > 0) return seconds;
  } catch (const std::exception&) {  // falls through to the same message
  }
  throw Problem("--benchmark_min_time takes a number of seconds, not \"" + value + "\"");
}

void set_flag(const std::string& flag, const std::string& value, Options& options) {
  const std::map<std::string, bool Options::*> switches = {
      {"help", &Options::help},
      {"describe", &Options::describe},
      {"quiet", &Options::quiet},
      {"verbose", &Options::verbose},
      {"parsable_output", &Options::parsable},
      {"track_memory", &Options::track_memory}};
  if (const auto found = switches.find(flag); found != switches.end()) {
    options.*found->second = read_switch(flag, value);
  } else if (flag == "benchmarks") {
    if (value != "all") throw Problem("--benchmarks takes \"all\", not \"" + value + "\"");
    options.benchmark = true;
  } else if (flag == "benchmark_min_time") {
    options.min_seconds = read_seconds(value);
  } else if (flag == "name") {
    options.filter = value;
  } else if (flag == "output_extents") {
    options.output_extents = value;
  } else if (flag == "default_input_buffers") {
    options.default_buffers = value.empty() ? "zero:auto" : value;
  } else if (flag == "default_input_scalars") {
    options.default_scalars = value.empty() ? "estimate,default" : value;
  } else if (flag == "estimate_all") {
    options.default_buffers = "estimate_then_auto";
    options.default_scalars = "estimate";
    options.output_extents = "estimate";
  } else {
    throw Problem("there is no flag --" + flag + "; see --help");
  }
}

}  // namespace

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts(1);
  for (const char c : text) {
    if (c == separator)
      parts.emplace_back();
    else
      parts.back() += c;
  }
  return parts;
}

std::vector<int> read_extents(const std::string& text) {
  const Problem problem("extents must be numbers like [640,480,3], not \"" + text + "\"");
  if (text.size() < 2 || text.front() != '[' || text.back() != ']') throw problem;
  const std::string list = text.substr(1, text.size() - 2);
  std::vector<int> extents;
  if (list.empty()) return extents;
  for (const std::string& word : split(list, ',')) {
    int extent = 0;
    const auto [stop, error] = std::from_chars(word.data(), word.data() + word.size(), extent);
    if (error != std::errc() || stop != word.data() + word.size() || extent < 0) throw problem;
    extents.push_back(extent);
  }
  return extents;
}

Options read_options(int argc, const char* const* argv) {
  Options options;
  for (int i = 1; i < argc; i++) {
    std::string word = argv[i];
    const bool is_flag = word.rfind("-", 0) == 0;
    if (is_flag) word = word.substr(word.rfind("--", 0) == 0 ? 2 : 1);
    const size_t equals = word.find('=');
    const std::string key = word.substr(0, equals);
    const std::string value = equals == std::string::npos ? "" : word.substr(equals + 1);
    if (is_flag) {
      set_flag(key, value, options);
    } else if (equals == std::string::npos || key.empty()) {
      throw Problem("\"" + word + "\" is neither name=value nor a flag; see --help");
    } else if (!options.values.emplace(key, value).second) {
      throw Problem("\"" + key + "\" is given twice");
    }
  }
  return options;
}

std::string usage(const std::string& program) {
  return "usage: " + program + R"( name=value ... [flags]

  Runs a compiled function once, with a value for each of its arguments:
    scalars   gain=1.5, or the words default or estimate for values that the generator sets; in a
              list with commas, the first one that is set
    inputs    a file, or generated values: zero:SHAPE  constant:VALUE:SHAPE  identity:SHAPE
              random:SEED:SHAPE
              SHAPE is [640,480,3], auto: the size that the output requires, estimate: the generator's
              estimate, or estimate_then_auto. A shape alone means random values
    outputs   a file to be written; outputs without a file are computed and discarded
  Files: .npy and .tmp of any type; .pgm, .ppm, .png and .jpg of 8 and 16 bits, whose values
  become fractions of 1 if the function takes floats.

  --help                       this text
  --describe                   the function's arguments and their types
  --name=NAME                  the function to run, if the program contains several
  --output_extents=[W,H,...]   the size of every output, or estimate; default: the largest for which
                               the inputs suffice
  --default_input_buffers=V    value of unnamed inputs; without =V: zero:auto
  --default_input_scalars=V    value of unnamed scalars; without =V: estimate,default
  --estimate_all               use the generator's estimates for all inputs and output sizes
  --benchmarks=all             run it many times and print the best time
  --benchmark_min_time=S       benchmark for at least S seconds; default: 0.1
  --track_memory               print the peak memory of intermediate results
  --parsable_output            print one result per line: NAME KEY VALUE
  --quiet                      discard what the function prints
  --verbose                    print shapes and steps
)";
}

}  // namespace retrograde::run_gen
