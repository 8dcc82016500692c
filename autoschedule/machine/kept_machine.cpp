#include "autoschedule/machine/kept_machine.h"

#include <cctype>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <optional>

#include "diagnostics/error.h"

namespace retrograde::planning {

namespace {

std::optional<std::string> contents_of(const std::string& path) {
  std::ifstream in(path);
  if (!in) return std::nullopt;
  return std::string(std::istreambuf_iterator<char>(in), {});
}

std::string variable_of_environment(const char* name) {
  const char* value = std::getenv(name);
  return value ? value : "";
}

Machine machine_in(const std::string& path) {
  if (const auto text = contents_of(path)) return Machine::from_json(*text, path);
  user_error("read the machine in " + retrograde::quoted(path),
             "RETROGRADE_MACHINE names a file with the description of a machine",
             "it cannot be read", "Make it: out/build/release/tools/tune --machine --output FILE");
}

}  // namespace

std::string processor_name() {
  std::ifstream in("/proc/cpuinfo");
  for (std::string line; std::getline(in, line);) {
    const size_t colon = line.find(": ");
    if (line.rfind("model name", 0) == 0 && colon != std::string::npos)
      return line.substr(colon + 2);
  }
  return "unknown processor";
}

std::string cache_folder() {
  if (const std::string cache = variable_of_environment("XDG_CACHE_HOME"); !cache.empty())
    return cache + "/retrograde";
  const std::string home = variable_of_environment("HOME");
  return home.empty() ? "" : home + "/.cache/retrograde";
}

std::string kept_file_name() {
  std::string name =
      "machine-" + processor_name() + "-v" + std::to_string(figures_version) + ".json";
  for (char& c : name) {
    if (!std::isalnum(static_cast<unsigned char>(c)) && c != '.' && c != '-') c = '_';
  }
  return name;
}

Machine machine_for(const Target& target) {
  if (const std::string path = variable_of_environment("RETROGRADE_MACHINE"); !path.empty())
    return machine_in(path);
  Machine constants = constants_for(target);
  const std::string folder = cache_folder();
  if (folder.empty()) return constants;
  if (const auto text = contents_of(folder + "/" + kept_file_name())) {
    try {
      const Machine measured = Machine::from_json(*text, folder);
      // Figures of vectors of another width do not apply.
      if (measured.vector_bytes == constants.vector_bytes) return measured;
    } catch (const UserError&) {  // counts as missing
    }
  }
  return constants;
}

}  // namespace retrograde::planning
