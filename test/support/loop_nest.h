// Reads the text of loop_nest().
#pragma once

#include <sstream>
#include <string>
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

}  // namespace retrograde
