// command.cpp -- see command.h.
#include "command.h"

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <exception>

#include "common/options.h"
#include "diagnostics/error.h"

namespace bench {

using retrograde::text;

bool parse_command_line(CLI::App& app, int argc, char** argv) {
  return apps::parse_words(app, argc, argv, "each option takes one value");
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
