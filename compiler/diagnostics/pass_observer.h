// pass_observer.h -- observes the compiler: the time and the result of each pass.
//
//   PassObserver observer([](const PassReport& r) { times[r.pass] += r.seconds; });
//   f.compile_jit();
//
// Environment variables do the same for unmodified programs. RETROGRADE_PASS_LOG=FILE appends a
// line per pass to a file; RETROGRADE_DUMP_AFTER=PASS,... (or "all") adds the results of these
// passes. `opt -- program` sets both and shows the file.
#pragma once

#include <functional>
#include <string>

namespace retrograde {

struct PassReport {
  std::string pipeline;  // the name of the compiled function
  std::string pass;
  double seconds = 0;
  std::function<std::string()> text;  // the program after the pass; empty for passes inside LLVM
};

// While it lives, `observe` is called for every pass of every compilation in the process, one call
// at a time, on the compiling thread. It must not compile anything itself.
class PassObserver {
 public:
  explicit PassObserver(std::function<void(const PassReport&)> observe);
  ~PassObserver();
  PassObserver(const PassObserver&) = delete;
  PassObserver& operator=(const PassObserver&) = delete;

 private:
  const std::function<void(const PassReport&)> observe_;
};

// Called by the compiler; cheap without observers.
void tell_pass_observers(const PassReport& report);

}  // namespace retrograde
