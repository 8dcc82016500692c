// Renumbers names, so that texts are equal if they differ only in numbers unique to the process.
#pragma once

#include <map>
#include <regex>
#include <string>

#include "graph/names.h"

namespace retrograde {

// Numbers names in the order in which they appear: the first v$31 or v becomes v, the next different one v$1. In names
// of reduction variables the domain is numbered: r$7.x and r$7.y become r.x and r.y. After a domain, any numbered name
// is renumbered: rho$8.r$7.x becomes rho.r.x.
inline std::string same_numbers(const std::string& text) {
  static const std::regex name(
      "(^|[^A-Za-z_0-9$.]|\\.(?=[A-Za-z_0-9]+\\$))([A-Za-z_][A-Za-z_0-9$]*)");
  std::map<std::string, std::map<std::string, size_t>>
      numbers;  // for each name without its number: the numbers seen
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
