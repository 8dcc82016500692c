#include "pair_file.h"

#include <cstdlib>
#include <map>
#include <sstream>

#include "diagnostics/error.h"
#include "graph/graph.h"

namespace bench::plans {

using namespace retrograde;

namespace {

constexpr const char* mark = "=== ";
constexpr double milliseconds = 1e3;

std::string graph_text(const planning::Plan& plan) {
  return graph::to_text(
      graph::graph_of(planning::emit_plan(planning::undecided_plan(plan.program))));
}

std::string duration(double seconds) {
  std::ostringstream out;
  out.precision(3);
  out << milliseconds * seconds << " ms";
  return out.str();
}

[[noreturn]] void fail(const std::string& evidence) {
  user_error("read a pair of plans", "its text has the form of bench/plans/pair_file.h", evidence,
             "Write the file with bench_plans --pair");
}

// The text before the first mark has the empty name.
std::map<std::string, std::string> sections_of(const std::string& text) {
  std::map<std::string, std::string> sections;
  std::istringstream lines(text);
  std::string name;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with(mark))
      name = line.substr(std::string(mark).size());
    else
      sections[name] += line + "\n";
  }
  return sections;
}

double read_milliseconds(std::istringstream& words) {
  double value = 0;
  std::string unit;
  if (!(words >> value >> unit) || unit != "ms") fail("a time in ms is missing");
  return value / milliseconds;
}

void read_head(const std::string& head, PlanPair& pair) {
  std::istringstream lines(head);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string key;
    words >> key;
    if (key == "program") {
      words >> pair.program;
    } else if (key == "fast") {
      pair.fast_seconds = read_milliseconds(words);
    } else if (key == "slow") {
      pair.slow_seconds = read_milliseconds(words);
    } else if (key == "wrong") {
      for (std::string model; words >> model;) pair.wrong.insert(model);
    } else if (!key.empty() && key != "#") {
      fail("there is no " + retrograde::quoted(key));
    }
  }
}

planning::ProgramPtr program_of(const std::string& text, PlanPair& pair) {
  pair.graphs.push_back(graph::parse_graph(text));
  graph::validate(pair.graphs.back(), "parse_graph");
  return planning::make_program(pair.graphs.back().outputs);
}

}  // namespace

std::string to_text(const PlanPair& pair) {
  std::string text = "program  " + pair.program + "\nfast  " + duration(pair.fast_seconds) +
                     "\nslow  " + duration(pair.slow_seconds) + "\nwrong";
  for (const std::string& model : pair.wrong) text += "  " + model;
  const std::string fast_graph = graph_text(pair.fast), slow_graph = graph_text(pair.slow);
  const auto section = [&](const std::string& name, const std::string& contents) {
    text += mark + name + "\n" + contents;
  };
  text += "\n";
  section("fast graph", fast_graph);
  section("fast plan", planning::to_text(pair.fast));
  if (slow_graph != fast_graph) section("slow graph", slow_graph);
  section("slow plan", planning::to_text(pair.slow));
  return text;
}

PlanPair parse_pair(const std::string& text) {
  std::map<std::string, std::string> sections = sections_of(text);
  PlanPair pair;
  read_head(sections[""], pair);
  for (const char* name : {"fast graph", "fast plan", "slow plan"}) {
    if (!sections.contains(name))
      fail("there is no section " + retrograde::quoted(std::string(name)));
  }
  const planning::ProgramPtr fast = program_of(sections["fast graph"], pair);
  const bool has_own = sections.contains("slow graph");
  const planning::ProgramPtr slow = has_own ? program_of(sections["slow graph"], pair) : fast;
  pair.fast = planning::parse_plan(sections["fast plan"], fast);
  pair.slow = planning::parse_plan(sections["slow plan"], slow);
  return pair;
}

}  // namespace bench::plans
