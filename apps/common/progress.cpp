// progress.cpp -- see progress.h.
#include "common/progress.h"

#include <unistd.h>

#include <algorithm>

namespace apps {

namespace {
constexpr int bar_width = 32;
constexpr int lines_in_all = 10;
constexpr auto redraw_every = std::chrono::milliseconds(100);
}  // namespace

Progress::Progress(std::FILE* out, int total)
    : out_(out), total_(std::max(total, 1)), terminal_(::isatty(::fileno(out)) == 1) {}

Progress::~Progress() {
  if (open_) std::fputc('\n', out_);
}

void Progress::show(int done, const std::string& note) {
  if (first_ < 0) {
    first_ = done;
    started_ = std::chrono::steady_clock::now();
  }
  if (terminal_) return draw_bar(done, note);
  if (done < next_line_ && done < total_) return;
  std::fprintf(out_, "%d of %d  %s%s\n", done, total_, note.c_str(), time_left(done).c_str());
  const int every = std::max(total_ / lines_in_all, 1);
  next_line_ = (done / every + 1) * every;
}

std::string Progress::time_left(int done) const {
  if (done <= first_ || done >= total_) return {};
  const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - started_;
  const double left = taken.count() * (total_ - done) / (done - first_);
  char text[48];
  std::snprintf(text, sizeof text, left < 90 ? "  %.0f s left" : "  %.0f min left",
                left < 90 ? left : left / 60);
  return text;
}

void Progress::draw_bar(int done, const std::string& note) {
  const auto now = std::chrono::steady_clock::now();
  if (now < next_draw_ && done < total_) return;
  next_draw_ = now + redraw_every;
  const int filled = static_cast<int>(static_cast<long>(bar_width) * done / total_);
  const std::string bar = std::string(filled, '#') + std::string(bar_width - filled, '.');
  std::fprintf(out_, "\r[%s] %d of %d  %s%s\x1b[K", bar.c_str(), done, total_, note.c_str(),
               time_left(done).c_str());
  std::fflush(out_);
  open_ = true;
}

}  // namespace apps
