#include <algorithm>
#include <climits>
#include <cmath>
#include <iomanip>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>
#include <tuple>

#include "autoschedule/machine/kept_machine.h"
#include "diagnostics/error.h"

namespace retrograde::planning {

namespace {

using Json = nlohmann::json;

struct Figure {
  const char* name;
  double Machine::*value;
  const char* meaning;
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

// Reads one object. Each error names the figure and its value.
class FigureReader {
 public:
  FigureReader(const Json& json, std::string of) : json_(json), of_(std::move(of)) {}

  double positive(const char* name) const {
    const Json& value = at(name);
    if (!value.is_number()) refuse(name, "a number");
    const double number = value.get<double>();
    if (!(number > 0) || !std::isfinite(number)) refuse(name, "a positive number");
    return number;
  }
  int whole(const char* name) const {
    const Json& value = at(name);
    const bool is_whole =
        value.is_number_integer() && value.get<double>() >= 1 && value.get<double>() <= INT_MAX;
    if (!is_whole) refuse(name, "a positive integer");
    return value.get<int>();
  }
  std::string text(const char* name) const {
    if (!at(name).is_string()) refuse(name, "text");
    return at(name).get<std::string>();
  }
  const Json& at(const char* name) const {
    if (!json_.is_object() || !json_.contains(name))
      throw std::invalid_argument("it has no " + of_ + name);
    return json_.at(name);
  }
  [[noreturn]] void refuse(const char* name, const std::string& wanted) const {
    throw std::invalid_argument(of_ + name + " is " + at(name).dump() + ", not " + wanted);
  }

 private:
  const Json& json_;
  std::string of_;
};

std::array<Machine::Level, Machine::level_count> read_levels(const FigureReader& all) {
  const Json& json = all.at("levels");
  std::array<Machine::Level, Machine::level_count> levels;
  if (!json.is_array() || json.size() != levels.size())
    all.refuse("levels", std::to_string(levels.size()) + " caches, the last of them memory");
  for (size_t i = 0; i < levels.size(); i++) {
    const FigureReader level(json[i], "levels[" + std::to_string(i) + "].");
    levels[i] = {level.text("name"), level.positive("bytes"), level.positive("one_thread"),
                 level.positive("all_threads")};
    if (i > 0 && levels[i].bytes < levels[i - 1].bytes)
      level.refuse("bytes", "at least those of the level before");
  }
  return levels;
}

Machine read_machine(const Json& json) {
  const FigureReader all(json, "");
  if (all.whole("version") != figures_version)
    all.refuse("version", std::to_string(figures_version));
  Machine machine;
  machine.name = all.text("name");
  machine.threads = all.whole("threads");
  machine.vector_bytes = all.whole("vector_bytes");
  machine.registers = all.whole("registers");
  machine.levels = read_levels(all);
  for (const Figure& figure : figures) machine.*figure.value = all.positive(figure.name);
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
        << this->*figure.value << "  " << figure.meaning << "\n";
  }
  return out.str();
}

}  // namespace retrograde::planning
