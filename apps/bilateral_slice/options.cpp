// options.cpp -- see options.h.
#include "options.h"

#include <CLI/CLI.hpp>

#include "common/number_options.h"
#include "diagnostics/error.h"

namespace bilateral_slice {

namespace {

// Checks that the options select exactly one task: one photo, a folder of pairs, or applying a look.
void check_work(const Options& options) {
  if (options.pairs.empty() != options.input.empty() &&
      (options.apply.empty() || options.pairs.empty()))
    return;
  apps::refuse_command_line("either --input or --pairs is required",
                            options.input.empty() ? "neither is given" : "both are given",
                            "Run with --help for the options");
}

}  // namespace

// If the grid stays the identity, all its layers are equal, and then the guide has no effect.
void check_groups(const Options& options) {
  if (options.resume && !options.start.empty()) {
    apps::refuse_command_line("a run either resumes from a state or starts from a look",
                              "both --resume and --start are given", "Leave out one of them");
  }
  const bool learns = options.apply.empty() && !options.check_gradients &&
                      !options.check_stability && !options.time_steps;
  if (!learns || options.moves.grid || !options.start.empty() || options.resume) return;
  retrograde::call_error(
      "learn the guide alone",
      "the guide has no effect if all layers of the grid are equal, as in the identity",
      "--optimize does not contain grid, and there is no initial look",
      "Give --start LOOK, a learned look.bin, or add grid to --optimize");
}

std::optional<Options> read_options(int argc, char** argv) {
  Options options;
  CLI::App app(
      "Learns the look of edited photographs: a bilateral grid of colour transforms and a guide "
      "curve, fitted by Adam.");
  apps::add_common_options(app, options,
                           {.needs_input = false,
                            .input_text = "the photograph",
                            .steps = 200,
                            .optimize = {"grid", "mix", "curve"}});
  app.add_option(
      "--target", options.target,
      "the edited photograph, of the same size; without it, a built-in local tone mapping");
  app.add_option(
      "--pairs", options.pairs,
      "instead of --input: a folder of photographs, with a folder \"target\" in it of "
      "their edits under the same names (else the built-in one); one look for all of them");
  app.add_option("--apply", options.apply, "instead of learning: the look.bin for --input");
  app.add_option(
      "--start", options.start,
      "the initial look, a look.bin, which also sets the grid's size; default: the identity");
  apps::NumberOptions numbers(app);
  numbers.add("--grid", options.grid, {3, 256, true},
              "nodes along each side; 0: 64, or 3 with --pairs");
  numbers.add("--halide-seconds", options.halide_seconds, {0, 1e6},
              "time limit for the comparison with Halide 14; 0: no comparison");
  numbers.add("--check-side", options.check_side, {4, 96, true},
              "pixels along each side of the crop for --check-gradients; 0: 96 x 80");
  app.add_flag(
      "--time-steps", options.time_steps,
      "instead of learning: the time of a step, by optimized groups, and for a gray photo");
  if (!apps::parse_command_line(app, argc, argv, options)) return std::nullopt;
  check_work(options);
  options.moves = {apps::optimizes(options, "grid"), apps::optimizes(options, "mix"),
                   apps::optimizes(options, "curve")};
  check_groups(options);
  numbers.check();
  return options;
}

}  // namespace bilateral_slice
