// options.cpp -- see options.h.
#include "options.h"

#include <CLI/CLI.hpp>

#include "common/minimize.h"
#include "scene.h"

namespace lens {

std::optional<Options> read_options(int argc, char** argv) {
  Options options;
  CLI::App cli(
      "Makes a lens shorter at the same focal length, F-number and field, and its image no worse: "
      "rays through all surfaces, their derivatives, and an optimizer.");
  apps::add_common_options(cli, options.common,
                           {.input_text = "a prescription, as in apps/lens/prescriptions",
                            .steps = 4000,
                            .optimize = groups});
  options.common.optimize = {"curvatures", "spacings"};
  cli.add_option("--method", options.method, "adam, lbfgs, conjugate_gradient or newton_cg")
      ->capture_default_str();
  cli.add_flag("--compare", options.compare,
               "run Adam, L-BFGS and Newton-CG, and keep the best result");
  cli.add_option("--shorter", options.shorter_percent,
                 "percent of the length, from first vertex to image")
      ->capture_default_str();
  cli.add_option("--wavelengths", options.wavelengths, "1: d; 2: F and C; 3: F, d and C")
      ->capture_default_str();
  cli.add_option("--fields", options.fields, "directions, from the axis to half the field")
      ->capture_default_str();
  cli.add_option("--stages", options.stages, "number of stages in which the length is reduced")
      ->capture_default_str();
  cli.add_option("--restarts", options.restarts,
                 "additional random starts, because the loss has many minima")
      ->capture_default_str();
  if (!apps::parse_command_line(cli, argc, argv, options.common)) return std::nullopt;
  apps::method_named(options.method);
  apps::require_in_range("--shorter", options.shorter_percent, 0, 60);
  apps::require_in_range("--wavelengths", options.wavelengths, 1, 3);
  apps::require_in_range("--fields", options.fields, 1, 20);
  apps::require_in_range("--stages", options.stages, 1, 100);
  apps::require_in_range("--restarts", options.restarts, 0, 100000);
  return options;
}

}  // namespace lens
