// progress.h -- how far a long run has come: a bar on a terminal, a line now and then elsewhere.
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

  std::FILE* out_;
  int total_;
  bool terminal_;
  bool open_ = false;  // a bar stands on the terminal's last line
  int next_line_ = 0;  // elsewhere: the count from which the next line is due
  std::chrono::steady_clock::time_point next_draw_{};
};

}  // namespace apps
