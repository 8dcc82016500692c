// progress.h -- shows the progress of a long run and the time left: a bar on a terminal, an occasional line elsewhere.
#pragma once

#include <chrono>
#include <cstdio>
#include <string>

namespace apps {

class Progress {
 public:
  // Writes to `out` (the programs pass standard error).
  Progress(std::FILE* out, int total);
  ~Progress();

  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  // `done`: steps done so far; `note`: a few words shown to the right.
  void show(int done, const std::string& note);

 private:
  void draw_bar(int done, const std::string& note);
  // "12 s left", extrapolated from the time since the first call; empty while unknown.
  std::string time_left(int done) const;

  std::FILE* out_;
  int total_;
  bool terminal_;
  bool open_ = false;  // a bar is on the terminal's last line
  int next_line_ = 0;  // not on a terminal: the count at which to print the next line
  int first_ = -1;     // the count at the first call, and its time
  std::chrono::steady_clock::time_point started_{};
  std::chrono::steady_clock::time_point next_draw_{};
};

}  // namespace apps
