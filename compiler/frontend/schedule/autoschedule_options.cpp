// autoschedule_options.cpp -- the options of the built-in autoscheduler as text, as generators take them.
#include "frontend/schedule/autoschedule_options.h"

#include <algorithm>
#include <charconv>

#include "diagnostics/error.h"
#include "frontend/language/func.h"

namespace retrograde {

namespace {

// Names in the order of the enumeration.
const std::vector<std::string>& names_of_decisions() {
  static const std::vector<std::string> names{
      "scatter_strategy", "cut_reductions", "register_tiles", "layout_staging", "join_sweeps",
      "slices",           "task_sizes",     "strips",         "choices"};
  return names;
}

std::vector<std::string> split_at(const std::string& text, char separator) {
  std::vector<std::string> parts;
  for (size_t begin = 0; begin <= text.size();) {
    const size_t end = std::min(text.find(separator, begin), text.size());
    if (end > begin) parts.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return parts;
}

std::string joined(const std::vector<std::string>& words, char separator) {
  std::string result;
  for (const std::string& word : words)
    result += (result.empty() ? "" : std::string(1, separator)) + word;
  return result;
}

class OptionsReader {
 public:
  explicit OptionsReader(const std::string& text)
      : asked_("read the options of the autoscheduler " + quoted(text)) {
    for (const std::string& part : split_at(text, ',')) read(part);
  }
  AutoscheduleOptions options;

 private:
  void read(const std::string& part) {
    const size_t equals = part.find('=');
    const std::string key = part.substr(0, equals);
    const std::string value = equals == std::string::npos ? "" : part.substr(equals + 1);
    if (key == "without") {
      for (const std::string& name : split_at(value, '+')) options.without.insert(decision(name));
    } else if (key == "store") {
      for (const std::string& name : split_at(value, '+')) options.store.emplace_back(name);
    } else if (key == "inline") {
      for (const std::string& name : split_at(value, '+')) options.inlined.emplace_back(name);
    } else if (key == "threads") {
      options.threads = number<int>(value);
    } else if (key == "memory") {
      options.memory_budget = number<int64_t>(value);
    } else if (key == "search") {
      options.search = truth(value);
    } else if (key == "deterministic") {
      options.deterministic = truth(value);
    } else {
      user_error(
          asked_, "options of the autoscheduler are parts of a name and a value",
          quoted(part) +
              " is not: names are \"without\", \"store\", \"inline\", \"threads\", \"memory\", "
              "\"search\" and \"deterministic\"",
          "Write for example without=strips+slices,threads=4");
    }
  }

  Decision decision(const std::string& name) const {
    const std::vector<std::string>& names = names_of_decisions();
    const auto found = std::find(names.begin(), names.end(), name);
    if (found == names.end()) {
      user_error(asked_, "the decisions of the autoscheduler have names",
                 quoted(name) + " is not one of " + listed(names, quoted), "Name one of these");
    }
    return all_decisions()[static_cast<size_t>(found - names.begin())];
  }

  bool truth(const std::string& value) const {
    if (value != "true" && value != "false") {
      user_error(asked_, "search and deterministic are true or false",
                 quoted(value) + " is neither", "Write for example search=true");
    }
    return value == "true";
  }

  template <typename T>
  T number(const std::string& value) const {
    T result = -1;
    const char* end = value.data() + value.size();
    const auto [stop, error] = std::from_chars(value.data(), end, result);
    if (error != std::errc() || stop != end || result < 0) {
      user_error(asked_, "threads and bytes are whole numbers, 0 or more",
                 quoted(value) + " is not such a number", "Write for example threads=4");
    }
    return result;
  }

  const std::string asked_;
};

}  // namespace

const std::vector<Decision>& all_decisions() {
  static const std::vector<Decision> all{
      Decision::ScatterStrategy, Decision::CutReductions, Decision::RegisterTiles,
      Decision::LayoutStaging,   Decision::JoinSweeps,    Decision::Slices,
      Decision::TaskSizes,       Decision::Strips,        Decision::Choices};
  return all;
}

std::string to_string(Decision decision) {
  return names_of_decisions()[static_cast<size_t>(decision)];
}

FuncName::FuncName(const Func& func) : name(func.name()) {}

std::string AutoscheduleOptions::to_string() const {
  std::vector<std::string> parts, names;
  const auto add = [&](const std::string& key) {
    if (!names.empty()) parts.push_back(key + "=" + joined(names, '+'));
    names.clear();
  };
  for (Decision decision : without) names.push_back(retrograde::to_string(decision));
  add("without");
  for (const FuncName& f : store) names.push_back(f.name);
  add("store");
  for (const FuncName& f : inlined) names.push_back(f.name);
  add("inline");
  if (threads != 0) names.push_back(std::to_string(threads));
  add("threads");
  if (memory_budget != 0) names.push_back(std::to_string(memory_budget));
  add("memory");
  if (search) names.emplace_back("true");
  add("search");
  if (!deterministic) names.emplace_back("false");
  add("deterministic");
  return joined(parts, ',');
}

AutoscheduleOptions AutoscheduleOptions::from_string(const std::string& text) {
  return OptionsReader(text).options;
}

}  // namespace retrograde
