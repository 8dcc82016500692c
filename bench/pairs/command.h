// command.h -- the command line of a benchmark that compares two compilers: parsing, names of workloads, errors.
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace bench {

// Parses the command line. Returns false after printing the help for --help. Throws retrograde::UserError.
bool parse_command_line(CLI::App& app, int argc, char** argv);

// Throws retrograde::UserError unless the benchmark has all these workloads. `kind` is the noun for one of them, and
// the name of the option that selects it.
void require_known(const std::string& kind, const std::vector<std::string>& asked,
                   const std::vector<std::string>& known);

// Runs main(): a crashed worker is an error of its workload only, and an exception becomes one line and status 1.
int run_benchmark(const std::string& name, const std::function<int()>& body);

}  // namespace bench
