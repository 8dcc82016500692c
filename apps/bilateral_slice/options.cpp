// options.cpp -- see options.h.
#include "options.h"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <thread>

#include "diagnostics/error.h"

namespace bilateral_slice {

using retrograde::text;

namespace {

void require_in_range(const char* option, double value, double low, double high) {
  if (value >= low && value <= high) return;
  retrograde::call_error(text("run with ", option, " ", value),
                         text("it must lie between ", low, " and ", high),
                         text(value, value < low ? " is too small" : " is too large"),
                         text("Give ", option, " a number in that range, or leave it out"));
}

}  // namespace

std::optional<Options> read_options(int argc, char** argv) {
  Options options;
  options.threads = static_cast<int>(std::max(std::thread::hardware_concurrency(), 1u));
  CLI::App app(
      "Learns the look of an edited photograph: a bilateral grid of colour transforms and a "
      "guide curve, fitted by Adam.");
  app.add_option("--input", options.input, "the photograph")->required();
  app.add_option(
      "--target", options.target,
      "the edited photograph, of the same size; without it, a built-in local tone mapping");
  app.add_option("--output", options.output, "folder for the results")->required();
  app.add_option("--steps", options.steps, "steps of Adam")->capture_default_str();
  app.add_option("--threads", options.threads, "threads, for both languages")
      ->capture_default_str();
  app.add_option("--halide-seconds", options.halide_seconds,
                 "how long to measure the same with Halide 14; 0 to leave it out")
      ->capture_default_str();
  app.add_flag("--check-gradients", options.check_gradients,
               "instead of learning: the model's adjoints against tangents, differences and the "
               "complex step, into gradients.json and gradients.png");
  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp&) {
    std::fputs(app.help().c_str(), stdout);
    return std::nullopt;
  } catch (const CLI::ParseError& error) {
    retrograde::call_error("understand the command line",
                           "--input and --output are needed, and each option takes one value",
                           error.what(), "Run with --help for the options");
  }
  require_in_range("--steps", options.steps, 1, 1'000'000);
  require_in_range("--threads", options.threads, 1, 1024);
  require_in_range("--halide-seconds", options.halide_seconds, 0, 1e6);
  return options;
}

}  // namespace bilateral_slice
