// options.cpp -- see options.h.
#include "options.h"

#include <CLI/CLI.hpp>
#include <algorithm>

#include "command.h"

namespace bench {

const std::vector<std::string>& kernel_names() {
  static const std::vector<std::string> names{
#define KERNEL(name) #name,
#include "../list.def"
  };
  return names;
}

const std::vector<std::string>& gradient_names() {
  static const std::vector<std::string> names{
#define GRADIENT(name) #name,
#include "../list.def"
  };
  return names;
}

bool is_gradient(const std::string& name) {
  return std::count(gradient_names().begin(), gradient_names().end(), name) > 0;
}

std::optional<Options> read_options(int argc, char** argv) {
  Options options;
  CLI::App app("Forward pipelines with one schedule, compiled by Halide 14 and by Retrograde.");
  bool gradients = false;
  app.add_option("--kernel", options.kernels, "run this kernel; may be given several times");
  app.add_flag("--gradients", gradients,
               "run gradients instead, which each compiler derives and schedules itself");
  app.add_flag("--quick", options.quick, "few runs of each; the numbers are only rough");
  auto* rounds = app.add_option("--rounds", options.rounds, "timed runs of each side")
                     ->check(CLI::Range(1, 100000))
                     ->capture_default_str();
  app.add_option("--output", options.output, "the report, as JSON")->capture_default_str();
  if (!parse_command_line(app, argc, argv)) return std::nullopt;
  if (options.quick && rounds->count() == 0) options.rounds = 7;
  std::vector<std::string> known = kernel_names();
  known.insert(known.end(), gradient_names().begin(), gradient_names().end());
  require_known("kernel", options.kernels, known);
  if (options.kernels.empty()) options.kernels = gradients ? gradient_names() : kernel_names();
  return options;
}

}  // namespace bench
