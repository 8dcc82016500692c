#include "gradient/adversary/scheduled_program.h"

#include <algorithm>

#include "testing/programs/large.h"

namespace retrograde::gradient {

namespace {

constexpr int threads[] = {0, 1, 2, 5, 16};

Extents choose_extents(Choices& choices, bool is_large) {
  const int which = choices.below(20);
  if (which >= 17) return Extents::Estimated;
  if (which >= 14) return Extents::Parameters;
  if (is_large || which < 8) return Extents::Constant;
  return which >= 12 ? Extents::Huge : Extents::One;
}

AutoscheduleOptions choose_options(Choices& choices) {
  AutoscheduleOptions options;
  if (!choices.chance(20)) return options;
  options.threads = threads[choices.below(static_cast<int>(std::size(threads)))];
  for (const Decision decision : all_decisions()) {
    if (choices.chance(25)) options.without.insert(decision);
  }
  return options;
}

// A program with a few hundred states does not count as large: it keeps the default options.
AdversaryProgram large(Choices& choices, fuzz::LargeSizes sizes) {
  return {fuzz::make_large_program(choices, sizes), {}, false, {}};
}

}  // namespace

ScheduledProgram make_scheduled(Choices& choices, std::optional<fuzz::Workload> workload) {
  const int kind = choices.below(20);
  const bool is_large = kind >= 12 && !workload;
  ScheduledProgram result;
  result.extents = choose_extents(choices, is_large);
  result.told = choose_options(choices);
  result.is_whole = !choices.chance(20);
  if (workload) {
    result.program = make_workload_adversary(choices, *workload);
  } else if (is_large) {
    Choices again = choices;
    result.small = large(again, fuzz::LargeSizes::Small);
    result.program = large(choices, fuzz::LargeSizes::Full);
  } else {
    result.program =
        make_adversary(choices, kind < 8 ? fuzz::Style::gradients()
                                         : fuzz::Style::pieces());  // programs of any size
  }
  for (oracle::Region& region : result.program.runs.front()) {
    std::vector<int>& sides = region.extents;
    if (result.extents == Extents::One) std::fill(sides.begin(), sides.end(), 1);
  }
  return result;
}

std::string to_text(const ScheduledProgram& scheduled) {
  static const char* const extents[] = {"constant", "one", "parameters", "huge",
                                        "parameters with estimates"};
  return to_text(scheduled.program) + "extents: " + extents[static_cast<int>(scheduled.extents)] +
         (scheduled.is_whole ? "\nscheduled as a whole" : "\nscheduled by default") +
         "\ntold: " + scheduled.told.to_string() + "\n";
}

}  // namespace retrograde::gradient
