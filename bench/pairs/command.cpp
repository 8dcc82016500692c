// command.cpp -- see command.h.
#include "command.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <csignal>
#include <cstdio>
#include <exception>

#include "diagnostics/error.h"

namespace bench {

using retrograde::text;

bool parse_command_line(CLI::App& app, int argc, char** argv) {
  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp&) {
    std::fputs(app.help().c_str(), stdout);
    return false;
  } catch (const CLI::ParseError& error) {
    retrograde::call_error("understand the command line", "each option takes one value",
                           error.what(), "Run with --help for the options");
  }
  return true;
}

void require_known(const std::string& kind, const std::vector<std::string>& asked,
                   const std::vector<std::string>& known) {
  for (const std::string& name : asked) {
    if (std::count(known.begin(), known.end(), name)) continue;
    retrograde::call_error(
        text("run the ", kind, " ", retrograde::quoted(name)), "it must be one of the benchmark's",
        text("they are ", retrograde::listed(known, [](const std::string& each) { return each; })),
        text("Give --", kind, " one of these names"));
  }
}

int run_benchmark(const std::string& name, const std::function<int()>& body) {
  std::signal(SIGPIPE, SIG_IGN);
  try {
    return body();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", name.c_str(), error.what());
    return 1;
  }
}

}  // namespace bench
