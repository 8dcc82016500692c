// run_app.cpp -- see run_app.h.
#include "common/run_app.h"

#include <tbb/global_control.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <exception>
#include <new>

#include "common/files.h"
#include "common/stop.h"
#include "diagnostics/error.h"

namespace apps {

namespace {

std::string one_line(std::string text) {
  while (!text.empty() && text.back() == '\n') text.pop_back();
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

void say(const std::string& name, const std::string& message) {
  std::fprintf(stderr, "%s: %s\n", name.c_str(), message.c_str());
}

}  // namespace

int run_app(const std::string& name, int argc, char** argv,
            const std::function<void(int argc, char** argv)>& body) {
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
  catch_stop_signals();
  try {
    body(argc, argv);
    return 0;
  } catch (const std::bad_alloc&) {
    say(name,
        "cannot go on: a run needs memory for its input and all that is computed from it; none was "
        "left. Make the input smaller.");
  } catch (const retrograde::InternalError& error) {
    say(name, error.what());  // with everything that a bug report needs
  } catch (const std::exception& error) {
    say(name, one_line(error.what()));
  }
  return 1;
}

struct ThreadLimit::Limit {
  tbb::global_control control;
};

ThreadLimit::ThreadLimit(int threads)
    : limit_(new Limit{tbb::global_control(tbb::global_control::max_allowed_parallelism,
                                           static_cast<size_t>(std::max(threads, 1)))}) {}

ThreadLimit::~ThreadLimit() = default;

RunScope::RunScope(const CommonOptions& options) : threads_(options.threads) {
  require_writable_folder(options.output);
}

}  // namespace apps
