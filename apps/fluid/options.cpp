// options.cpp -- see options.h.
#include "options.h"

#include <CLI/CLI.hpp>
#include <string>

#include "common/number_options.h"
#include "diagnostics/error.h"

namespace fluid {

using retrograde::quoted;
using retrograde::text;

namespace {

constexpr const char* purpose =
    "Finds the force, and optionally viscosity, diffusion and time step, that bring smoke in a "
    "closed box to the shape of a picture.";

struct Words {
  std::vector<std::string> methods{"adam"};
  std::string solver = "direct";
};

void add_scene_options(CLI::App& cli, apps::NumberOptions& numbers, Options& o) {
  cli.add_option("--start", o.start,
                 "picture of the initial smoke; default: a disc with as much smoke as the input");
  numbers.add("--frames", o.frames, {1, 100'000}, "frames from the start to the picture");
  numbers.add("--cells", o.cells, {4, 10'000, true},
              "cells along the longer side; 0: the picture's pixels");
  numbers.add("--force-nodes", o.force_nodes, {2, 10'000, true},
              "nodes of the force along the longer side; 0: one per cell");
  cli.add_option("--force-from", o.force_from, "state.bin of another run, whose force is used");
  numbers.add("--swirl", o.swirl, {-1e3, 1e3}, "speed of an initial vortex, in sides per second");
  numbers.add("--time-step", o.physics.time_step, {1e-9, 1e6}, "seconds per frame");
  numbers.add("--viscosity", o.physics.viscosity, {0, 1e9},
              "viscosity in sides squared per second; 0: none");
  numbers.add("--diffusion", o.physics.diffusion, {0, 1e9},
              "diffusion of the smoke in the same unit; 0: none");
}

void add_solution_options(CLI::App& cli, apps::NumberOptions& numbers, Options& o, Words& words) {
  numbers.add("--reach", o.reach, {0, 10},
              "distance over which smoke is attracted to its target, in sides");
  numbers.add("--effort", o.effort, {0, 1e6}, "weight of the mean squared force");
  cli.add_option(
         "--method", words.methods,
         "adam, lbfgs, conjugate_gradient, or several of these, of which the best result counts")
      ->delimiter(',')
      ->capture_default_str();
  numbers.add("--rate", o.rate, {1e-9, 1e6}, "Adam's rate: change of the force per step");
  cli.add_option("--solver", words.solver, "solver for pressure and diffusion: direct or jacobi")
      ->capture_default_str();
  numbers.add("--iterations", o.iterations, {1, 1000}, "iterations of jacobi");
}

Solver solver_named(const std::string& name) {
  if (name == "direct") return Solver::Direct;
  if (name == "jacobi") return Solver::Jacobi;
  retrograde::call_error(text("solve by ", quoted(name)), "a solver is direct or jacobi",
                         "this is neither", "Give one of these names");
}

// A variable that is optimized as a logarithm needs a positive initial value.
void require_start(const Options& o, const char* group, const char* option, double value) {
  if (!apps::optimizes(o.common, group) || value > 0) return;
  retrograde::call_error(
      text("optimize the ", group, " from ", option, " ", value),
      "it is optimized as a logarithm, so that it stays positive", "0 has no logarithm",
      text("Give ", option, " a small positive number, or leave ", group, " out of --optimize"));
}

void check(const Options& o) {
  require_start(o, "viscosity", "--viscosity", o.physics.viscosity);
  require_start(o, "diffusion", "--diffusion", o.physics.diffusion);
  for (const apps::Method method : o.methods) {
    if (method != apps::Method::NewtonCg) continue;
    retrograde::call_error("optimize by \"newton_cg\"", "it needs Hessian-vector products",
                           "a simulation gives first derivatives only",
                           "Give adam, lbfgs or conjugate_gradient");
  }
}

}  // namespace

std::optional<Options> read_options(int argc, char** argv) {
  Options options;
  Words words;
  CLI::App cli(purpose);
  apps::add_common_options(cli, options.common,
                           {.input_text = "the target picture of the smoke",
                            .steps = 150,
                            .memory_mb = 1000,
                            .optimize = {"force", "viscosity", "diffusion", "time_step"}});
  apps::NumberOptions numbers(cli);
  add_scene_options(cli, numbers, options);
  add_solution_options(cli, numbers, options, words);
  if (!apps::parse_command_line(cli, argc, argv, options.common)) return std::nullopt;
  for (const std::string& name : words.methods) options.methods.push_back(apps::method_named(name));
  options.solver = solver_named(words.solver);
  numbers.check();
  check(options);
  return options;
}

}  // namespace fluid
