// division.cpp -- see division.h.
#include "common/division.h"

#include <fstream>
#include <sstream>

#include "common/images.h"
#include "common/json_files.h"
#include "diagnostics/error.h"

namespace apps {

using retrograde::quoted;
using retrograde::text;

namespace {

constexpr const char* list_name = "photographs.txt";
constexpr size_t held_out_every = 4;

[[noreturn]] void refuse_list(const std::filesystem::path& list, const std::string& evidence) {
  retrograde::call_error(text("read the list of photographs ", quoted(list.string())),
                         "each of its lines is \"train FILE\" or \"held_out FILE\"", evidence,
                         "Correct it, or take it away: then every fourth photograph is held out");
}

Division division_by_list(const std::filesystem::path& folder) {
  Division division{.words = text("as ", list_name, " says")};
  const auto list = folder / list_name;
  std::ifstream file(list);
  std::string line;
  while (std::getline(file, line)) {
    std::istringstream words(line.substr(0, line.find('#')));
    std::string kind, name;
    if (!(words >> kind)) continue;
    if (!(words >> name) || (kind != "train" && kind != "held_out")) {
      refuse_list(list, is_text(line) ? text("it has the line ", quoted(line))
                                      : std::string("it is a binary file"));
    }
    (kind == "train" ? division.train : division.held_out).push_back(folder / name);
  }
  return division;
}

Division division_by_name(const std::filesystem::path& folder) {
  Division division{.words = "every fourth by name, and the last, are held out"};
  const auto files = images_in(folder);
  for (size_t n = 0; n < files.size(); ++n) {
    const bool held_out = n % held_out_every == held_out_every - 1 || n + 1 == files.size();
    (held_out ? division.held_out : division.train).push_back(files[n]);
  }
  return division;
}

}  // namespace

Division division_of(const std::filesystem::path& folder) {
  Division division = std::filesystem::exists(folder / list_name) ? division_by_list(folder)
                                                                  : division_by_name(folder);
  if (division.train.empty() || division.held_out.empty()) {
    retrograde::call_error(
        text("learn from the photographs in ", quoted(folder.string())),
        "some are learned from and others are measured on, so that there are two at least",
        text("there are ", division.train.size(), " to learn from and ", division.held_out.size(),
             " to measure on"),
        "Add photographs");
  }
  return division;
}

}  // namespace apps
