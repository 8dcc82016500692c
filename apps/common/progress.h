// progress.h -- how far a long run has come and how long it may still take: a bar on a terminal, a
// line now and then elsewhere.
#pragma once

#include <chrono>
#include <cstdio>
#include <string>

namespace apps {

class Progress {
 public:
  // Writes to `out` (standard error in the programs).
  Progress(std::FILE* out, int total);
  ~Progress();

  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  // `done` of the total; `note` is a few words to its right.
  void show(int done, const std::string& note);

 private:
  void draw_bar(int done, const std::string& note);
  // "12 s left", from the time that the work since the first call took; empty while unknown.
  std::string time_left(int done) const;

  std::FILE* out_;
  int total_;
  bool terminal_;
  bool open_ = false;  // a bar stands on the terminal's last line
  int next_line_ = 0;  // elsewhere: the count from which the next line is due
  int first_ = -1;     // what was done at the first call, and when that was
  std::chrono::steady_clock::time_point started_{};
  std::chrono::steady_clock::time_point next_draw_{};
};

}  // namespace apps
