// options.h -- command-line options that all apps share; one call adds them to an app's own options.
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
  std::filesystem::path input, output;  // output: the folder for results
  long steps = 0;
  double seconds = 0;  // of optimization; 0: no limit
  int threads = 1;
  uint64_t seed = 1;
  double memory_mb = 0;               // 0: no limit
  std::vector<std::string> optimize;  // the groups of parameters to optimize
  bool check_gradients = false, check_stability = false, explain = false;
  bool resume = false;

  bool is_check() const { return check_gradients || check_stability; }
};

// Which of these options an app has, and their defaults.
struct CommonDefaults {
  bool needs_input = true;
  std::string input_text = "the input";
  long steps = 100;
  double seconds = 0;
  double memory_mb = 0;  // if positive, there is an option --memory with this default
  std::vector<std::string> optimize =
      {};  // if not empty, there is an option --optimize with all of these as default
};

void add_common_options(CLI::App& cli, CommonOptions& options, const CommonDefaults& defaults);

// Parses a command line, also one without common options. Returns false after printing the help for --help. Throws
// retrograde::UserError, which states `rule`.
bool parse_words(CLI::App& cli, int argc, char** argv, const std::string& rule);

// Parses the command line and checks ranges and names. Returns false after printing the help for --help. Throws
// retrograde::UserError with a one-line message.
bool parse_command_line(CLI::App& cli, int argc, char** argv, CommonOptions& options);

// Rejects the command line. Throws retrograde::UserError.
[[noreturn]] void refuse_command_line(const std::string& rule, const std::string& evidence,
                                      const std::string& instead);

// The check of all numeric options. Throws retrograde::UserError unless low <= value <= high.
void require_in_range(const std::string& option, double value, double low, double high);

// Whether --optimize names the group.
bool optimizes(const CommonOptions& options, const std::string& group);

// Prints a line for each group whose gradient is left out because --optimize does not name it.
void print_left_out_groups(const CommonOptions& options, const std::vector<std::string>& groups);

// For report.json.
nlohmann::json to_json(const CommonOptions& options);

}  // namespace apps
