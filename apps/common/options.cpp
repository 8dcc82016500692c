// options.cpp -- see options.h.
#include "common/options.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <thread>

#include "diagnostics/error.h"

namespace apps {

using retrograde::quoted;
using retrograde::text;

namespace {

// CLI takes the group names as free text; this checks them.
void add_optimize_option(CLI::App& cli, CommonOptions& options,
                         const std::vector<std::string>& groups) {
  options.optimize = groups;
  const std::string names =
      retrograde::listed(groups, [](const std::string& name) { return name; });
  cli.add_option("--optimize", options.optimize, "groups of variables to optimize, among " + names)
      ->delimiter(',')
      ->capture_default_str()
      ->check([groups, names](const std::string& name) {
        if (std::find(groups.begin(), groups.end(), name) != groups.end()) return std::string();
        return text("there is no ", quoted(name), " to optimize, but ", names);
      });
}

void check_ranges(const CLI::App& cli, const CommonOptions& options) {
  require_in_range("--steps", static_cast<double>(options.steps), 1, 1'000'000);
  require_in_range("--seconds", options.seconds, 0, 1e6);
  require_in_range("--threads", options.threads, 1, 1024);
  const CLI::Option* memory = cli.get_option_no_throw("--memory");
  if (memory) require_in_range("--memory", options.memory_mb, 1, 1e7);
}

}  // namespace

void add_common_options(CLI::App& cli, CommonOptions& options, const CommonDefaults& defaults) {
  options.steps = defaults.steps;
  options.seconds = defaults.seconds;
  options.memory_mb = defaults.memory_mb;
  options.threads = static_cast<int>(std::max(std::thread::hardware_concurrency(), 1u));
  cli.add_option("--input", options.input, defaults.input_text)->required(defaults.needs_input);
  cli.add_option("--output", options.output, "folder for the results")->required();
  cli.add_option("--steps", options.steps, "steps of the optimizer")->capture_default_str();
  cli.add_option("--seconds", options.seconds, "time limit for the optimization; 0: none")
      ->capture_default_str();
  cli.add_option("--threads", options.threads, "threads")->capture_default_str();
  cli.add_option("--seed", options.seed, "seed of all random numbers")->capture_default_str();
  cli.add_flag("--check-gradients", options.check_gradients,
               "instead of a run: check adjoints against differences and the complex step");
  cli.add_flag("--check-stability", options.check_stability,
               "instead of a run: compare float32 with double in extreme cases");
  cli.add_flag("--explain", options.explain,
               "print what is computed, and what is left out because nothing needs it");
  cli.add_flag("--resume", options.resume, "continue from the state in the output folder");
  if (defaults.memory_mb > 0) {
    cli.add_option("--memory", options.memory_mb, "memory limit of a run in MB")
        ->capture_default_str();
  }
  if (!defaults.optimize.empty()) add_optimize_option(cli, options, defaults.optimize);
}

bool parse_words(CLI::App& cli, int argc, char** argv, const std::string& rule) {
  try {
    cli.parse(argc, argv);
  } catch (const CLI::CallForHelp&) {
    std::fputs(cli.help().c_str(), stdout);
    return false;
  } catch (const CLI::ParseError& error) {
    std::string evidence = error.what();
    std::replace(evidence.begin(), evidence.end(), '\n', ' ');
    refuse_command_line(rule, evidence, "Run with --help for the options");
  }
  return true;
}

bool parse_command_line(CLI::App& cli, int argc, char** argv, CommonOptions& options) {
  if (!parse_words(cli, argc, argv,
                   "options must be as --help describes, and required ones present"))
    return false;
  check_ranges(cli, options);
  return true;
}

void refuse_command_line(const std::string& rule, const std::string& evidence,
                         const std::string& instead) {
  retrograde::call_error("understand the command line", rule, evidence, instead);
}

void require_in_range(const std::string& option, double value, double low, double high) {
  if (value >= low && value <= high) return;
  retrograde::call_error(text("run with ", option, " ", value),
                         text("it must lie between ", low, " and ", high),
                         text(value, value < low ? " is too small" : " is too large"),
                         text("Give ", option, " a number in that range, or leave it out"));
}

bool optimizes(const CommonOptions& options, const std::string& group) {
  return std::find(options.optimize.begin(), options.optimize.end(), group) !=
         options.optimize.end();
}

void print_left_out_groups(const CommonOptions& options, const std::vector<std::string>& groups) {
  for (const std::string& group : groups) {
    if (optimizes(options, group)) continue;
    std::printf("left out: the gradient by %s, which --optimize does not name\n", group.c_str());
  }
}

nlohmann::json to_json(const CommonOptions& options) {
  return {{"input", options.input.string()}, {"output", options.output.string()},
          {"steps", options.steps},          {"seconds", options.seconds},
          {"threads", options.threads},      {"seed", options.seed},
          {"memory_mb", options.memory_mb},  {"optimize", options.optimize},
          {"resume", options.resume}};
}

}  // namespace apps
