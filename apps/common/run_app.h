// run_app.h -- the common part of every app's main(): errors, signals, threads.
//
//   int main(int argc, char** argv) {
//     return apps::run_app("lens", argc, argv, [](int c, char** v) { lens::run(c, v); });
//   }
//
// Exceptions from the body become one line on standard error, "lens: cannot ...", and status 1. Only our own bugs
// (retrograde::InternalError) keep all lines, which a bug report needs. SIGINT and SIGTERM request a stop (stop.h). A
// closed pipe and an exceeded file size are errors of calls, not signals.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "common/options.h"

namespace apps {

int run_app(const std::string& name, int argc, char** argv,
            const std::function<void(int argc, char** argv)>& body);

// Limits the threads of parallel loops during its lifetime.
class ThreadLimit {
 public:
  explicit ThreadLimit(int threads);
  ~ThreadLimit();
  ThreadLimit(const ThreadLimit&) = delete;
  ThreadLimit& operator=(const ThreadLimit&) = delete;

 private:
  struct Limit;
  std::unique_ptr<Limit> limit_;
};

// The preparation of every run: requires a writable output folder, and limits the threads during its lifetime.
class RunScope {
 public:
  explicit RunScope(const CommonOptions& options);

 private:
  ThreadLimit threads_;
};

}  // namespace apps
