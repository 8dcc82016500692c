#include "tuning/machine.h"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iomanip>
#include <iterator>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>
#include <tuple>

#include "diagnostics/error.h"
#include "ir/vector_bytes.h"
#include "jit/private_folder.h"

namespace retrograde::tuning {

namespace {

using Json = nlohmann::json;

// Grows when what the figures mean changes: what was measured before is then measured again.
constexpr int figures_version = 1;

struct Figure {
  const char* name;
  double Machine::*value;
  const char* what;
};
constexpr Figure figures[] = {
    {"operation_ns", &Machine::operation_ns, "sum, product, multiply-add of a vector"},
    {"divide_ns", &Machine::divide_ns, "quotient of a vector of float32"},
    {"divide_double_ns", &Machine::divide_double_ns, "of float64"},
    {"sqrt_ns", &Machine::sqrt_ns, "square root of a vector of float32"},
    {"sqrt_double_ns", &Machine::sqrt_double_ns, "of float64"},
    {"exp_ns", &Machine::exp_ns, "exp of a vector of float32"},
    {"log_ns", &Machine::log_ns, "log"},
    {"pow_ns", &Machine::pow_ns, "pow"},
    {"sin_ns", &Machine::sin_ns, "sin, cos"},
    {"load_ns", &Machine::load_ns, "load of a vector from L1"},
    {"store_ns", &Machine::store_ns, "store of a vector to L1"},
    {"gather_lane_ns", &Machine::gather_lane_ns, "one lane of a gather"},
    {"scatter_lane_ns", &Machine::scatter_lane_ns, "one lane of a scatter"},
    {"shuffle_ns", &Machine::shuffle_ns, "shuffle of a vector"},
    {"scalar_ns", &Machine::scalar_ns, "scalar operation"},
    {"scalar_divide_ns", &Machine::scalar_divide_ns, "quotient of integers"},
    {"latency_ns", &Machine::latency_ns, "multiply-add that waits for the one before"},
    {"memory_latency_ns", &Machine::memory_latency_ns, "the same through memory"},
    {"iteration_ns", &Machine::iteration_ns, "iteration of a loop"},
    {"launch_ns", &Machine::launch_ns, "launch of a parallel loop"},
    {"page_ns", &Machine::page_ns, "first touch of a page"},
};

std::string file_name() {
  std::string name =
      "machine-" + processor_name() + "-v" + std::to_string(figures_version) + ".json";
  for (char& c : name) {
    if (!std::isalnum(static_cast<unsigned char>(c)) && c != '.' && c != '-') c = '_';
  }
  return name;
}

std::optional<std::string> contents_of(const std::string& path) {
  std::ifstream in(path);
  if (!in) return std::nullopt;
  return std::string(std::istreambuf_iterator<char>(in), {});
}

std::string variable_of_environment(const char* name) {
  const char* value = std::getenv(name);
  return value ? value : "";
}

double positive(const Json& json) {
  const double value = json.get<double>();
  if (!(value > 0) || !std::isfinite(value))
    throw std::invalid_argument("a figure is not positive");
  return value;
}

Machine read_machine(const Json& json) {
  Machine machine;
  if (json.at("version").get<int>() != figures_version)
    throw std::invalid_argument("it is of another version");
  machine.name = json.at("name").get<std::string>();
  for (const auto& [name, value] : {std::tuple("threads", &Machine::threads),
                                    std::tuple("vector_bytes", &Machine::vector_bytes),
                                    std::tuple("registers", &Machine::registers)}) {
    machine.*value = json.at(name).get<int>();
    if (machine.*value < 1) throw std::invalid_argument("a figure is not positive");
  }
  const Json& levels = json.at("levels");
  for (size_t i = 0; i < Machine::level_count; i++) {
    const Json& level = levels.at(i);
    machine.levels[i] = {level.at("name").get<std::string>(), positive(level.at("bytes")),
                         positive(level.at("one_thread")), positive(level.at("all_threads"))};
  }
  for (const Figure& figure : figures) machine.*figure.value = positive(json.at(figure.name));
  return machine;
}

}  // namespace

std::string Machine::to_json() const {
  Json json = {{"version", figures_version},
               {"name", name},
               {"threads", threads},
               {"vector_bytes", vector_bytes},
               {"registers", registers}};
  for (const Level& level : levels) {
    json["levels"].push_back({{"name", level.name},
                              {"bytes", level.bytes},
                              {"one_thread", level.one_thread},
                              {"all_threads", level.all_threads}});
  }
  for (const Figure& figure : figures) json[figure.name] = this->*figure.value;
  return json.dump(2) + "\n";
}

Machine Machine::from_json(const std::string& text, const std::string& where) {
  try {
    return read_machine(Json::parse(text));
  } catch (const std::exception& error) {
    user_error("read the machine in " + retrograde::quoted(where),
               "a description of a machine is JSON with a number for each figure", error.what(),
               "Make it again: out/build/release/tools/tune --machine");
  }
}

std::string Machine::to_string() const {
  std::ostringstream out;
  out << name << ": " << threads << " threads, vectors of " << vector_bytes << " bytes, "
      << registers << " registers\n";
  out << std::setprecision(3);
  for (const Level& level : levels) {
    out << "  " << std::left << std::setw(20) << level.name << std::right;
    if (level.bytes < 1e12)
      out << std::setw(10) << std::llround(level.bytes / 1024) << " KB";
    else
      out << std::setw(13) << "";
    out << std::setw(9) << level.one_thread << " GB/s, all threads " << level.all_threads << "\n";
  }
  for (const Figure& figure : figures) {
    out << "  " << std::left << std::setw(20) << figure.name << std::right << std::setw(10)
        << this->*figure.value << "  " << figure.what << "\n";
  }
  return out.str();
}

Machine constants_for(const Target& target) {
  Machine machine;
  machine.threads = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  machine.vector_bytes = ir::vector_bytes(target);
  machine.registers = machine.vector_bytes >= 64 || target.arch == Target::ARM ? 32 : 16;
  const double threads = machine.threads, width = machine.vector_bytes;
  machine.levels = {Machine::Level{"L1", 32 << 10, 4 * width, 4 * width * threads},
                    {"L2", 1 << 20, 1.2 * width, 1.2 * width * threads},
                    {"L3", 16 << 20, 18, 12 * threads},
                    {"memory", 1e15, 9, std::min(9 * threads, 25.0)}};
  return machine;
}

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

Machine machine_for(const Target& target) {
  if (const std::string path = variable_of_environment("RETROGRADE_MACHINE"); !path.empty()) {
    const auto text = contents_of(path);
    if (!text) {
      user_error("read the machine in " + retrograde::quoted(path),
                 "RETROGRADE_MACHINE names a file with the description of a machine",
                 "it cannot be read",
                 "Make it: out/build/release/tools/tune --machine --output FILE");
    }
    return Machine::from_json(*text, path);
  }
  Machine constants = constants_for(target);
  const std::string folder = cache_folder();
  if (folder.empty()) return constants;
  if (const auto text = contents_of(folder + "/" + file_name())) {
    try {
      const Machine measured = Machine::from_json(*text, folder);
      // Measured for vectors of another width, it says nothing of these.
      if (measured.vector_bytes == constants.vector_bytes) return measured;
    } catch (const UserError&) {  // as if it were not there
    }
  }
  return constants;
}

std::string keep_machine(const Machine& machine) {
  const std::string folder = cache_folder(), asked = "keep the figures of the machine";
  if (folder.empty()) {
    user_error(
        asked, "the cache folder can be written", "neither XDG_CACHE_HOME nor HOME is set",
        "Set one, or write them to a file: out/build/release/tools/tune --machine --output FILE");
  }
  mkdir(folder.substr(0, folder.rfind('/')).c_str(), 0700);  // where it fails the next step says so
  const jit::PrivateFolder files(folder, asked);
  if (!files.write(file_name(), machine.to_json(), true)) {
    user_error(asked, "the cache folder can be written", retrograde::quoted(folder) + " cannot",
               "Name another one by XDG_CACHE_HOME");
  }
  return folder + "/" + file_name();
}

}  // namespace retrograde::tuning
