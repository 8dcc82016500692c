#include "options.h"

#include <CLI/CLI.hpp>

#include "diagnostics/error.h"
#include "weights.h"

namespace demosaic {

namespace {

constexpr long usual_steps = 4000;

void require_valid(const Options& options) {
  if (options.common.input.empty() && options.dataset.empty()) {
    apps::refuse_command_line("there must be a picture to demosaic or photographs to learn from",
                              "neither --input nor --dataset was given",
                              "Give one of them, or both");
  }
  if (options.shape.filters != 2 && options.shape.filters != 9 && options.shape.filters != 15) {
    apps::refuse_command_line("the relaxed method comes with 2, 9 or 15 filters",
                              retrograde::text("--filters is ", options.shape.filters),
                              "Give one of these");
  }
  if (options.shape.size != 5 && options.shape.size != 7) {
    apps::refuse_command_line("filters have 5 x 5 or 7 x 7 samples",
                              retrograde::text("--size is ", options.shape.size), "Give 5 or 7");
  }
  const std::string& p = options.pattern;
  if (!p.empty() && p != "RGGB" && p != "GRBG" && p != "GBRG" && p != "BGGR") {
    apps::refuse_command_line(
        "a mosaic begins with RGGB, GRBG, GBRG or BGGR",
        retrograde::text("--mosaic is ", retrograde::quoted(p)),
        "Give one of these: the colours of its first row, then of its second");
  }
}

}  // namespace

std::optional<Options> read_options(int argc, char** argv) {
  Options options;
  CLI::App cli(
      "Makes colour pictures of what a camera's sensor sees through a Bayer mosaic: bilinear, by "
      "adaptive homogeneity (AHD), and by a relaxation of it whose filters and choices are learned "
      "from photographs.");
  apps::add_common_options(
      cli, options.common,
      {.needs_input = false,
       .input_text =
           "a picture, which is sampled as a mosaic first, or a mosaic (RAW, or --mosaic)",
       .steps = usual_steps,
       .optimize = group_names});
  cli.add_option("--dataset", options.dataset,
                 "a folder of photographs: learns from most of them, measures on the others "
                 "(photographs.txt in it may say which)");
  cli.add_option("--filters", options.shape.filters, "filters for green: 2, 9 or 15")
      ->capture_default_str();
  cli.add_option("--size", options.shape.size, "samples along a filter: 5 or 7")
      ->capture_default_str();
  cli.add_option("--weights", options.weights,
                 "weights written by an earlier run, instead of the shipped ones");
  cli.add_option("--mosaic", options.pattern,
                 "the input is one channel of samples that begin with these colours, as RGGB");
  cli.add_flag("--compare", options.compare, "measure every method on the dataset, learn nothing");
  cli.add_flag("--time-steps", options.time_steps,
               "with --compare: also measure the time of a learning step with fewer groups");
  cli.add_flag("--brief", options.brief, "leave out the shipped variants");
  if (!apps::parse_command_line(cli, argc, argv, options.common)) return std::nullopt;
  require_valid(options);
  return options;
}

}  // namespace demosaic
