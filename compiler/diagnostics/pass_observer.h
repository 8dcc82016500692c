// pass_observer.h -- observes compiler passes: the run time of each pass and the program after it.
//
//   PassObserver observer([](const PassReport& r) { times[r.pass] += r.seconds; });
//   f.compile_jit();
//
// The environment does the same for unmodified programs. RETROGRADE_PASS_LOG=FILE appends a line for every pass to a
// file, and RETROGRADE_DUMP_AFTER=PASS,... (or "all") also the program after these passes. `opt -- program` sets both
// and shows the file.
#pragma once

#include <functional>
#include <string>

namespace retrograde {

// One run of a compiler pass.
struct PassReport {
  std::string pipeline;               // name of the function
  std::string pass;                   // name of the pass
  double seconds = 0;                 // its run time
  std::function<std::string()> text;  // the program after it; empty for passes inside LLVM
};

// While it exists, the function receives every pass of every compilation in the process. Calls come one at a
// time, on the thread that compiles; the function must not compile anything.
class PassObserver {
 public:
  // Starts observing.
  explicit PassObserver(std::function<void(const PassReport&)> observe);
  ~PassObserver();
  PassObserver(const PassObserver&) = delete;
  PassObserver& operator=(const PassObserver&) = delete;

 private:
  const std::function<void(const PassReport&)> observe_;
};

// Reports a pass; cheap without observers.
void tell_pass_observers(const PassReport& report);

}  // namespace retrograde
