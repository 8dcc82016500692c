#include "graph/names.h"

#include <algorithm>
#include <cctype>
#include <mutex>
#include <unordered_map>

#include "ir/visit.h"

namespace retrograde::graph {

namespace {

std::string as_identifier(std::string name) {
  for (char& c : name) {
    if (!std::isalnum(static_cast<unsigned char>(c)) && c != '_' && c != '$') c = '_';
  }
  if (name.empty() || std::isdigit(static_cast<unsigned char>(name[0])))
    name.insert(name.begin(), '_');
  return name;
}

enum class NameOwner { Func, Parameter };

// Records the owner of each claimed name. Names that contain '$' come from unique_name and need no
// entry.
class NameTable {
 public:
  std::string claim(const std::string& name, NameOwner owner) {
    if (name.find('$') != std::string::npos) return unique_name(name);
    std::lock_guard lock(mutex_);
    auto [it, is_new] = owners_.try_emplace(name, owner);
    if (is_new || (owner == NameOwner::Parameter && it->second == NameOwner::Parameter))
      return name;
    return unique_name(name);
  }

 private:
  std::mutex mutex_;
  std::unordered_map<std::string, NameOwner> owners_;
};

NameTable& name_table() {
  static NameTable table;
  return table;
}

}  // namespace

std::string claim_name(const std::string& wanted) {
  return name_table().claim(as_identifier(wanted), NameOwner::Func);
}

std::string claim_parameter_name(const std::string& wanted) {
  return name_table().claim(as_identifier(wanted), NameOwner::Parameter);
}

std::string without_numbers(const std::string& name) {
  std::string out;
  for (size_t i = 0; i < name.size(); ++i) {
    const size_t end = name[i] == '$' ? name.find_first_not_of("0123456789", i + 1) : i + 1;
    if (name[i] != '$') out += name[i];
    i = std::min(end, name.size()) - 1;
  }
  return out;
}

std::string implicit_name(int n) { return "_" + std::to_string(n); }
std::vector<std::string> implicit_names(int count) {
  return numbered(static_cast<size_t>(count),
                  [](size_t n) { return implicit_name(static_cast<int>(n)); });
}

int implicit_index(const std::string& name) {
  if (name.size() < 2 || name.size() > 4 || name[0] != '_') return -1;
  auto is_digit = [](unsigned char c) { return std::isdigit(c) != 0; };
  return std::all_of(name.begin() + 1, name.end(), is_digit) ? std::stoi(name.substr(1)) : -1;
}

}  // namespace retrograde::graph
