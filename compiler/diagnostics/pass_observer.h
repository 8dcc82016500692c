// pass_observer.h -- watching the compiler work: how long each pass took, and what it gave.
//
//   PassObserver observer([](const PassReport& r) { times[r.pass] += r.seconds; });
//   f.compile_jit();
//
// The same for programs that know nothing of it, by the environment: RETROGRADE_PASS_LOG=FILE
// appends a line for every pass to a file, and RETROGRADE_DUMP_AFTER=PASS,... (or "all") what these
// passes gave. `opt -- program` sets both and shows the file.
#pragma once

#include <functional>
#include <string>

namespace retrograde {

struct PassReport {
  std::string pipeline;  // the function's name
  std::string pass;
  double seconds = 0;
  std::function<std::string()> text;  // the program after it; empty for passes inside LLVM
};

// While it lives, it is told of every pass of every compilation in the process, one at a time, on
// whatever thread compiles. It must not compile anything itself.
class PassObserver {
 public:
  explicit PassObserver(std::function<void(const PassReport&)> observe);
  ~PassObserver();
  PassObserver(const PassObserver&) = delete;
  PassObserver& operator=(const PassObserver&) = delete;

 private:
  const std::function<void(const PassReport&)> observe_;
};

// What the compiler calls; cheap when nobody observes.
void tell_pass_observers(const PassReport& report);

}  // namespace retrograde
