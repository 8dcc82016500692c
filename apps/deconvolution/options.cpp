// options.cpp -- see options.h.
#include "options.h"

#include <CLI/CLI.hpp>

#include "common/number_options.h"
#include "diagnostics/error.h"
#include "weights.h"

namespace deconvolution {

namespace {

constexpr long usual_steps = 2000;

void require_sources(const Options& options) {
  const bool no_input = options.common.input.empty(), no_dataset = options.dataset.empty();
  if (no_input && no_dataset) {
    apps::refuse_command_line("there must be a picture to deconvolve or photographs to learn from",
                              "neither --input nor --dataset was given",
                              "Give one of them, or both");
  }
  if (no_dataset && (options.compare || options.tune || options.common.resume)) {
    apps::refuse_command_line("--compare, --tune and --resume need a dataset",
                              "there is no --dataset", "Give a folder of them");
  }
}

void require_odd_size(const Options& options) {
  if (options.shape.size % 2 == 1) return;
  apps::refuse_command_line("filters have an odd number of samples along a side",
                            retrograde::text("--size is ", options.shape.size), "Give 3, 5 or 7");
}

void add_learning_options(CLI::App& cli, apps::NumberOptions& numbers, Options& options) {
  cli.add_option("--dataset", options.dataset,
                 "a folder of photographs: learns from most of them, measures on the others "
                 "(photographs.txt in it may say which)");
  numbers.add("--filters", options.shape.filters, {1, 64}, "filters per learned stage");
  numbers.add("--size", options.shape.size, {3, 11}, "samples along a filter");
  numbers.add("--bumps", options.shape.bumps, {1, 12},
              "terms of the mixture that shrinks derivatives");
  numbers.add("--stages", options.stages, {1, 16}, "number of learned stages");
  cli.add_flag("--compare", options.compare,
               "measure the shipped methods on the dataset, learn nothing");
  cli.add_flag("--brief", options.brief, "leave out the shipped tuned and learned methods");
  cli.add_flag(
      "--tune", options.tune,
      "tune the numbers of the original method on the dataset by a scan; writes tuned.json");
}

}  // namespace

std::optional<Options> read_options(int argc, char** argv) {
  Options options;
  CLI::App cli(
      "Makes blurred photographs sharp whose point-spread function is known: by sparse adaptive "
      "priors in two stages, and by four stages whose filters, weights, shrinkage and smoothing "
      "are learned from photographs.");
  apps::add_common_options(
      cli, options.common,
      {.needs_input = false,
       .input_text = "a photograph, which is blurred first, or with --blurred a blurred one",
       .steps = usual_steps,
       .optimize = group_names});
  apps::NumberOptions numbers(cli);
  cli.add_option("--psf", options.psf,
                 "the point-spread function: disc:RADIUS, motion:SIZE[:SEED] or an image")
      ->capture_default_str();
  numbers.add("--noise", options.noise, {1e-4, 0.5}, "standard deviation of the noise; 1 is white");
  cli.add_flag("--blurred", options.blurred, "the input is already blurred by --psf");
  numbers.add("--iterations", options.iterations, {1, 10'000},
              "largest number of conjugate gradient iterations per stage");
  cli.add_option("--weights", options.weights,
                 "that an earlier run wrote, instead of those that come with the program; "
                 "learning goes on from them");
  add_learning_options(cli, numbers, options);
  if (!apps::parse_command_line(cli, argc, argv, options.common)) return std::nullopt;
  require_sources(options);
  numbers.check();
  require_odd_size(options);
  return options;
}

}  // namespace deconvolution
