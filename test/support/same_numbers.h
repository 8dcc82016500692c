// Renumbers names, so that texts which differ only in the process's unique numbers are equal.
#pragma once

#include <map>
#include <regex>
#include <string>

#include "graph/names.h"

namespace retrograde {

// In the order in which they appear: the first v$31 or v is v, the next other one is v$1. Of
// reduction variables the domain counts, r$7.x and r$7.y are r.x and r.y; behind it, what has a
// number: rho$8.r$7.x is rho.r.x.
inline std::string same_numbers(const std::string& text) {
  static const std::regex name(
      "(^|[^A-Za-z_0-9$.]|\\.(?=[A-Za-z_0-9]+\\$))([A-Za-z_][A-Za-z_0-9$]*)");
  std::map<std::string, std::map<std::string, size_t>> numbers;  // of each name without: those seen
  std::string result;
  auto at = text.begin();
  for (std::sregex_iterator it(text.begin(), text.end(), name), end; it != end; ++it) {
    const std::string found = it->str(2), plain = graph::without_numbers(found);
    result.append(at, text.begin() + it->position(2));
    at = text.begin() + it->position(2) + it->length(2);
    auto& seen = numbers[plain];
    const size_t number = seen.emplace(found, seen.size()).first->second;
    result += number == 0 ? plain : plain + "$" + std::to_string(number);
  }
  return result.append(at, text.end());
}

}  // namespace retrograde
