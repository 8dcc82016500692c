// run_app.h -- what every app's main() does around its work.
//
//   int main(int argc, char** argv) {
//     return apps::run_app("lens", argc, argv, [](int c, char** v) { lens::run(c, v); });
//   }
//
// Whatever the body throws becomes one line on standard error, "lens: cannot ...", and status 1; only
// our own bugs (retrograde::InternalError) keep all the lines that a report of them needs. SIGINT and
// SIGTERM ask it to stop (stop.h); a reader that went away and a file that grew too large are errors
// of a call, not signals.
#pragma once

#include <functional>
#include <memory>
#include <string>

namespace apps {

int run_app(const std::string& name, int argc, char** argv,
            const std::function<void(int argc, char** argv)>& body);

// At most this many threads work in parallel loops while the object lives.
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

}  // namespace apps
