// options.cpp -- see options.h.
#include "options.h"

#include <CLI/CLI.hpp>

#include "common/minimize.h"
#include "common/number_options.h"
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
  apps::NumberOptions numbers(cli);
  numbers.add("--shorter", options.shorter_percent, {0, 60},
              "percent of the length, from first vertex to image");
  numbers.add("--wavelengths", options.wavelengths, {1, 3}, "1: d; 2: F and C; 3: F, d and C");
  numbers.add("--fields", options.fields, {1, 20}, "directions, from the axis to half the field");
  numbers.add("--stages", options.stages, {1, 100},
              "number of stages in which the length is reduced");
  numbers.add("--restarts", options.restarts, {0, 100'000},
              "additional random starts, because the loss has many minima");
  if (!apps::parse_command_line(cli, argc, argv, options.common)) return std::nullopt;
  apps::method_named(options.method);
  numbers.check();
  return options;
}

}  // namespace lens
