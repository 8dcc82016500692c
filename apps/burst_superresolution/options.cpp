// options.cpp -- see options.h.
#include "options.h"

#include <CLI/CLI.hpp>

#include "common/number_options.h"
#include "diagnostics/error.h"

namespace burst {

namespace {

constexpr long usual_steps = 300;
constexpr const char* image_group = "image";
constexpr const char* motion_group = "homographies";
constexpr const char* both_groups = "both";

void add_simulation_options(apps::NumberOptions& numbers, Simulation& s) {
  numbers.add("--frames", s.frames, {1, 1000},
              "number of frames that are simulated from a photograph");
  numbers.add("--shake", s.shake, {0, 1000}, "movement of the camera between frames, in pixels");
  numbers.add("--rotation", s.rotation, {0, 20},
              "rotation of the camera between frames, in degrees");
  numbers.add("--noise", s.noise, {0, 1}, "standard deviation of each sample; 1 is white");
  numbers.add("--frame-size", s.frame_size, {least_side, 100'000, true},
              "largest number of pixels along each side of a frame; 0: as the photograph allows");
}

Colours colours_named(const std::string& name) {
  if (name == "rgb") return Colours::Rgb;
  if (name == "opponent") return Colours::Opponent;
  retrograde::call_error(retrograde::text("smooth the colours ", retrograde::quoted(name)),
                         "they are rgb or opponent", "this is neither", "Give one of these names");
}

Moves moves_of(const apps::CommonOptions& common) {
  const bool both = apps::optimizes(common, both_groups);
  return {both || apps::optimizes(common, image_group),
          both || apps::optimizes(common, motion_group)};
}

}  // namespace

std::optional<Options> read_options(int argc, char** argv) {
  Options options;
  CLI::App cli(
      "Combines a burst of mosaics from a shaking camera to one colour picture: the picture and "
      "every frame's homography are optimized together, by gradient descent.");
  apps::add_common_options(
      cli, options.common,
      {.input_text = "a folder of RAW frames (or images of one channel, with --mosaic), or a "
                     "photograph, from which a burst with known truth is simulated",
       .steps = usual_steps,
       .optimize = {image_group, motion_group, both_groups}});
  options.common.optimize = {both_groups};
  apps::NumberOptions numbers(cli);
  add_simulation_options(numbers, options.simulation);
  cli.add_option(
      "--mosaic", options.pattern,
      "the colours of the first two rows of the frames, as RGGB; RAW files contain them");
  cli.add_option("--lambda", options.lambda,
                 "weight of the differences of neighbours; default: chosen from the frames' noise");
  std::string colours = "rgb";
  cli.add_option(
         "--colours", colours,
         "colour axes of these differences: rgb, or opponent (light and two colour differences)")
      ->capture_default_str();
  cli.add_flag("--write-frames", options.write_frames,
               "also write the frames, as images of one channel, RGGB");
  if (!apps::parse_command_line(cli, argc, argv, options.common)) return std::nullopt;
  options.moves = moves_of(options.common);
  options.colours = colours_named(colours);
  options.simulation.seed = options.common.seed;
  numbers.check();
  if (options.lambda) apps::require_in_range("--lambda", *options.lambda, 0, 1e6);
  return options;
}

}  // namespace burst
