// tutorial.h -- code that the tutorials share: checked claims, and pictures.
#pragma once

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>
#include <vector>

// Prints the claim, and ends the program with status 1 if it does not hold.
inline void claim(bool holds, const std::string& what) {
  std::printf("%s %s\n", holds ? "yes:" : "NO:", what.c_str());
  if (!holds) std::exit(1);
}

// An SVG with curves over 0, 1, 2, ... and grids of grey cells. Numbers have three digits.
class Picture {
 public:
  explicit Picture(const std::string& title) { text(20, 22, title); }

  // `low` and `high` are the ends of the vertical axis, which all curves of a chart share.
  void curve(const std::string& name, const std::vector<double>& ys, double low, double high) {
    static const char* const colours[] = {"#1b6ca8", "#c8553d", "#4f772d", "#7b2d8b"};
    const std::string colour = colours[curves_ % 4];
    std::string points;
    for (size_t i = 0; i < ys.size(); ++i) {
      const double x = 20 + 440.0 * i / std::max<size_t>(ys.size() - 1, 1);
      const double share = (std::clamp(ys[i], low, high) - low) / (high - low);
      points += number(x) + "," + number(240 - 200 * share) + " ";
    }
    body_ += "<polyline fill='none' stroke-width='2' stroke='" + colour + "' points='" + points +
             "'/>\n";
    text(330, 40.0 + 18 * curves_++, name, colour);
  }
  // Rows of cells; the top left corner is at (x, y). `low` is white and `high` is black.
  void cells(double x, double y, double side, const std::vector<std::vector<double>>& rows,
             double low, double high) {
    for (size_t r = 0; r < rows.size(); ++r) {
      for (size_t c = 0; c < rows[r].size(); ++c) {
        const double share = (std::clamp(rows[r][c], low, high) - low) / (high - low);
        const std::string gray = std::to_string(static_cast<int>(255 - 255 * share));
        body_ += "<rect x='" + number(x + side * c) + "' y='" + number(y + side * r) + "' width='" +
                 number(side) + "' height='" + number(side) + "' fill='rgb(" + gray + "," + gray +
                 "," + gray + ")' stroke='#ccc' stroke-width='0.5'/>\n";
      }
    }
  }
  // Ends the program if the words would leave the picture on the right; letters are at most 7 wide on average.
  void text(double x, double y, const std::string& words, const std::string& colour = "#222") {
    if (x + 7.0 * words.size() > 480) claim(false, "the picture has room for \"" + words + "\"");
    body_ += "<text x='" + number(x) + "' y='" + number(y) +
             "' font-family='sans-serif' font-size='13' fill='" + colour + "'>" + words +
             "</text>\n";
  }

  // Writes the file into the folder that the command line names; does nothing if it names none.
  void write(int argc, char** argv, const std::string& name) const {
    if (argc < 2) return;
    std::ofstream file(std::string(argv[1]) + "/" + name + ".svg");
    file << "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 480 260'>\n"
         << "<rect width='480' height='260' fill='white'/>\n"
         << body_ << "</svg>\n";
    claim(file.good(), "the picture was written to " + std::string(argv[1]));
  }

 private:
  static std::string number(double v) {
    char digits[32];
    std::snprintf(digits, sizeof digits, "%.3g", v);
    return digits;
  }
  std::string body_;
  int curves_ = 0;
};
