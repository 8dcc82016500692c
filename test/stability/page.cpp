#include "stability/page.h"

#include <cmath>
#include <sstream>

namespace retrograde::stability {

namespace {

const char* const introduction = R"(# Stability: the accuracy of gradients

This page shows how accurate float32 gradients are at ordinary and at extreme inputs. `test/stability` differentiates
every program below with the compiler, runs the gradient as machine code and compares it with the true gradient.
Programs with 1 or 2 inputs run on every combination of ordinary and extreme numbers, others on 1,500 random ones.

- **A column** holds the cases whose most extreme number is of that kind. *large* numbers are above 50, where exp may
  overflow; *tiny* ones are below 1e-18, where the square vanishes; *huge* ones are above 1e18, where it overflows.
- **A cell** bounds the error of the gradient relative to its largest element. 1e-6 is a few roundings; "none" means no
  correct digit. "–" means that no case of the column has a true gradient.
- **Finite gradients.** Every gradient in these columns is finite if the true gradient is. "not finite" marks an
  exception: the rounding error of a cancellation overflows.
- **outside** holds the cases that float32 cannot represent: a value on the path taken, or its exact adjoint, overflows,
  vanishes or loses all its digits. The cell states how many of their gradients are finite, and the error of those.
  Another formulation of the program may avoid such cases.

Bounds are powers of ten, at least twice the measured error. `test/stability/stability_suite_test.cpp` writes the page.
)";

constexpr double smallest_bound = 1e-6, no_digit = 1;

// The smallest power of ten that is at least twice the error.
double bound_of(double error) {
  if (2 * error <= smallest_bound) return smallest_bound;
  return std::pow(10.0, std::ceil(std::log10(2 * error) - 1e-9));
}
std::string text_of_bound(double error) {
  const double bound = bound_of(error);
  if (bound >= no_digit) return "none";
  return "1e" + std::to_string(static_cast<int>(std::lround(std::log10(bound))));
}
double bound_of_text(const std::string& text) {
  return text == "none" ? std::numeric_limits<double>::infinity() : std::atof(text.c_str());
}

int tenths_finite(const Cell& cell) {
  return static_cast<int>(std::floor(10.0 * (cell.cases - cell.lost) / cell.cases));
}
std::string text_of_share(const Cell& cell) {
  return cell.lost == 0 ? "all" : std::to_string(10 * tenths_finite(cell)) + " %";
}

std::string row_start(const std::string& program) {
  std::string name;
  for (char c : program) name += c == '|' ? "\\|" : std::string(1, c);
  return "| " + name + " |";
}
std::string cell_text(const Cell& cell) {
  if (cell.cases == 0) return " – |";
  if (cell.lost > 0) return " not finite |";
  return " " + text_of_bound(cell.worst_error) + " |";
}
std::string row_text(const Row& row) {
  std::string result;
  for (const Cell& cell : row.cells) result += cell_text(cell);
  if (row.left.cases == 0) return result + " – |\n";
  return result + " " + text_of_share(row.left) + ", " + text_of_bound(row.left.worst_error) +
         " |\n";
}

std::vector<std::string> split(const std::string& text, const std::string& by) {
  std::vector<std::string> result;
  size_t start = 0;
  for (size_t at; (at = text.find(by, start)) != std::string::npos; start = at + by.size())
    result.push_back(text.substr(start, at - start));
  result.push_back(text.substr(start));
  return result;
}

// Compares a number of the page with a measured one: the bound must hold, and must not be a thousand times too large.
bool agree(const std::string& stated, double error) {
  const double bound = bound_of_text(stated);
  if (!(error <= bound)) return false;
  return stated == "none" ? error > 1e-3 : bound <= smallest_bound || bound <= 1e3 * error;
}
bool agree(const std::string& stated, const Cell& cell) {
  if (cell.cases == 0 || cell.lost > 0 || stated == "–" || stated == "not finite")
    return " " + stated + " |" == cell_text(cell);
  return agree(stated, cell.worst_error);
}
bool agree_outside(const std::string& stated, const Cell& cell) {
  if (cell.cases == 0 || stated == "–") return cell.cases == 0 && stated == "–";
  const auto parts = split(stated, ", ");
  if (parts.size() != 2 || !agree(parts[1], cell.worst_error)) return false;
  if (cell.lost == 0 || parts[0] == "all") return cell.lost == 0 && parts[0] == "all";
  return std::abs(std::atoi(parts[0].c_str()) / 10 - tenths_finite(cell)) <= 1;
}

}  // namespace

std::string render(const std::function<Row(const Problem&)>& measured) {
  std::ostringstream out;
  out << introduction;
  for (const Family& family : all_families()) {
    out << "\n## " << family.name << "\n\n| program |";
    for (int e = 0; e < extreme_count; ++e)
      out << " " << to_string(static_cast<Extreme>(e)) << " |";
    out << " outside |\n|---|";
    for (int e = 0; e <= extreme_count; ++e) out << "---|";
    out << "\n";
    for (const Problem& problem : family.problems)
      out << row_start(problem.name) << row_text(measured(problem));
  }
  return out.str();
}

std::string without_figures(const std::string& page) {
  std::string result;
  for (const std::string& line : split(page, "\n")) {
    auto cells = split(line, " | ");
    result += (cells.size() > extreme_count ? cells[0] : line) + "\n";
  }
  return result;
}

std::string disagreement_with(const std::string& page, const std::string& program, const Row& row) {
  const size_t start = page.find("\n" + row_start(program));
  if (start == std::string::npos) return "no row on the page";
  std::string line = page.substr(start + 1 + row_start(program).size());
  line = line.substr(0, line.find(" |\n"));
  const auto cells = split(line.substr(1), " | ");
  if (cells.size() != extreme_count + 1) return "a row of another form: " + line;
  for (size_t e = 0; e < extreme_count; ++e) {
    if (agree(cells[e], row.cells[e])) continue;
    std::ostringstream out;
    out << to_string(static_cast<Extreme>(e)) << ": " << cells[e] << " stated, "
        << row.cells[e].worst_error << " measured at " << row.cells[e].worst_at;
    return out.str();
  }
  if (agree_outside(cells.back(), row.left)) return "";
  return "outside: " + cells.back() + " stated, otherwise measured:" + row_text(row);
}

}  // namespace retrograde::stability
