// options.h -- the options that all apps share, added to an app's own command line by one call.
//
//   apps::CommonOptions common;
//   CLI::App cli("Makes a lens shorter.");
//   apps::add_common_options(cli, common, {.input_text = "a prescription", .steps = 300});
//   cli.add_option("--shorter", shorter, "how much, in percent");
//   if (!apps::parse_command_line(cli, argc, argv, common)) return;  // --help, which was printed
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace apps {

struct CommonOptions {
  std::filesystem::path input, output;  // output: the folder of the results
  long steps = 0;
  double seconds = 0;  // of optimizing; 0: as long as the steps take
  int threads = 1;
  uint64_t seed = 1;
  double memory_mb = 0;               // 0: as much as it takes
  std::vector<std::string> optimize;  // the groups of parameters that may move
  bool check_gradients = false, check_stability = false, explain = false;
  bool resume = false;
};

// What an app has of them.
struct CommonDefaults {
  bool needs_input = true;
  std::string input_text = "the input";
  long steps = 100;
  double seconds = 0;
  double memory_mb = 0;  // over 0: there is --memory, with this default
  std::vector<std::string> optimize =
      {};  // not empty: there is --optimize, all of these as default
};

void add_common_options(CLI::App& cli, CommonOptions& options, const CommonDefaults& defaults);

// Parses and checks ranges and names. False when only --help was asked for, which is then printed.
// Throws retrograde::UserError, in one line.
bool parse_command_line(CLI::App& cli, int argc, char** argv, CommonOptions& options);

// The rule of all numeric options. Throws retrograde::UserError unless low <= value <= high.
void require_in_range(const std::string& option, double value, double low, double high);

// Whether --optimize names the group.
bool optimizes(const CommonOptions& options, const std::string& group);

// For report.json.
nlohmann::json to_json(const CommonOptions& options);

}  // namespace apps
