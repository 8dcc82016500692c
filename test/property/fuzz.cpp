// fuzz_pipelines -- searches for random programs whose machine code disagrees with the interpreter. Its arguments are
// those of support/fuzz.h, and
//
//   --without DIRECTIVE    leaves it out of all schedules
//   --style STYLE          only chains, or only pipelines (testing/programs/program.h)
//   --only DIRECTIVE       seeds whose schedules do not use it are passed over and not counted
//
// A random schedule may multiply the work by a thousand, so a few programs may exceed the time limit.
#include <algorithm>

#include "graph/directives/directive.h"
#include "support/fuzz.h"
#include "testing/check_program.h"

namespace {

using namespace retrograde;
using namespace retrograde::fuzz;

struct Scheduled {
  RandomProgram program;
  ScheduleLog schedule;
  Watch watch = Watch::Accesses;
};

constexpr int watched_by_pages = 25;  // percent

std::vector<std::string> without;
std::string only;
std::string style;  // the style of the programs; empty: either one

// Removes every use of the directive from the schedule, with the directives that depend on it.
ScheduleLog leave_out(ScheduleLog log, const std::string& directive) {
  for (size_t i = log.size(); i-- > 0;) {
    if (i < log.size() && name_of(log.entries[i].directive) == directive) log = log.without(i);
  }
  return log;
}

Scheduled make(Choices& choices) {
  const bool is_chain = style == "chains" || (style.empty() && choices.chance(50));
  Scheduled result{make_program(choices, is_chain ? Style::chains() : Style::pipelines()), {}};
  result.schedule = random_schedule(result.program, choices,
                                    is_chain ? ScheduleStyle::windows() : ScheduleStyle());
  for (const std::string& directive : without)
    result.schedule = leave_out(result.schedule, directive);
  if (choices.chance(watched_by_pages)) result.watch = Watch::Pages;
  return result;
}

bool take(Fuzzer&, const std::string& name, const std::string& directive) {
  if (name == "--style") {
    style = directive;
    return style == "chains" || style == "pipelines";
  }
  const std::vector<std::string> known = graph::directive_names();
  if (std::find(known.begin(), known.end(), directive) == known.end()) return false;
  if (name == "--without") without.push_back(directive);
  if (name == "--only") only = directive;
  return name == "--without" || name == "--only";
}

}  // namespace

int main(int argc, char** argv) {
  const auto judge = [](Choices& choices, bool) {
    const Scheduled s = make(choices);
    return check_program(s.program, s.schedule, get_jit_target_from_environment(), s.watch);
  };
  const auto text = [](Choices& choices) {
    const Scheduled s = make(choices);
    return to_text(s.program, s.schedule);
  };
  const auto passes_over = [](Choices& choices) {
    if (only.empty()) return false;
    const ScheduleLog log = make(choices).schedule;
    return leave_out(log, only) == log;
  };
  return fuzz_main(
      {.judge = judge, .text = text, .most_slow = 0.01, .take = take, .passes_over = passes_over},
      argc, argv);
}
