#include "driver/schedule_difference.h"

#include <cctype>
#include <map>
#include <sstream>

namespace retrograde::driver {

namespace {

bool is_of_name(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '$';
}

std::set<std::string> funcs_of(const ScheduleLog& log) {
  std::set<std::string> names;
  for (const ScheduleLog::Entry& entry : log.entries) names.insert(entry.func);
  return names;
}

std::string only_in(const std::string& text, const std::string& other, const char* mark) {
  std::map<std::string, int> known;
  std::istringstream others(other), lines(text);
  for (std::string line; std::getline(others, line);) ++known[line];
  std::string result;
  for (std::string line; std::getline(lines, line);) {
    if (--known[line] < 0) result += mark + line + "\n";
  }
  return result;
}

}  // namespace

std::string with_stable_names(const ScheduleLog& log, const std::set<std::string>& known) {
  const std::string text = log.to_text();
  std::set<std::string> made;
  for (const ScheduleLog::Entry& entry : log.entries) made.insert(made_by(entry.directive));
  std::map<std::string, std::map<std::string, size_t>> numbers;
  std::string result;
  for (size_t at = 0; at < text.size();) {
    size_t end = at;
    while (end < text.size() && is_of_name(text[end])) ++end;
    const std::string name = text.substr(at, end - at);
    const size_t dollar = name.find('$');
    if (end == at) {
      result += text[end++];
    } else if (known.contains(name) || (dollar == std::string::npos && !made.contains(name))) {
      result += name;
    } else {
      const std::string plain = name.substr(0, dollar);
      auto& seen = numbers[plain];
      result += plain + "$" + std::to_string(seen.emplace(name, seen.size() + 1).first->second);
    }
    at = end;
  }
  return result;
}

std::string difference_of(const ScheduleLog& first, const ScheduleLog& second) {
  std::set<std::string> both;
  const std::set<std::string> others = funcs_of(second);
  for (const std::string& name : funcs_of(first)) {
    if (others.contains(name)) both.insert(name);
  }
  const std::string a = with_stable_names(first, both);
  const std::string b = with_stable_names(second, both);
  return only_in(a, b, "- ") + only_in(b, a, "+ ");
}

}  // namespace retrograde::driver
