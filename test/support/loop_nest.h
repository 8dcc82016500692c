// Reads the text of loop_nest().
#pragma once

#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "graph/names.h"

namespace retrograde {

// The names behind a keyword, from top to bottom and without their numbers: the Funcs that are produced, or the loops
// that are parallel.
inline std::vector<std::string> names_in_nest(const std::string& nest, const std::string& keyword) {
  std::vector<std::string> names;
  std::istringstream lines(graph::without_numbers(nest));
  for (std::string line, word, name; std::getline(lines, line);) {
    std::istringstream words(line);
    if (words >> word >> name && word == keyword) names.push_back(name.substr(0, name.find(':')));
  }
  return names;
}

// The loops around the place where a Func is produced, outermost first.
inline std::vector<std::string> loops_around(const std::string& nest, const std::string& func) {
  std::vector<std::pair<size_t, std::string>> open;  // indentation and name of each loop
  std::istringstream lines(graph::without_numbers(nest));
  for (std::string line; std::getline(lines, line);) {
    const size_t indent = line.find_first_not_of(' ');
    while (!open.empty() && open.back().first >= indent) open.pop_back();
    if (line.substr(indent) == "produce " + func + ":") break;
    if (line.compare(indent, 4, "for ") == 0)
      open.emplace_back(indent,
                        line.substr(indent + 4, line.find_first_of(": ", indent + 4) - indent - 4));
  }
  std::vector<std::string> names;
  for (const auto& [indent, name] : open) names.push_back(name);
  return names;
}

}  // namespace retrograde
