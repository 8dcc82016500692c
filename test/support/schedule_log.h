// Searches the entries of a schedule log.
#pragma once

#include <algorithm>
#include <string>
#include <variant>

#include "graph/directives/directive.h"
#include "graph/directives/schedule_log.h"
#include "graph/names.h"

namespace retrograde {

// The log without the numbers of names.
inline ScheduleLog without_numbers(const ScheduleLog& log) {
  return ScheduleLog::parse(graph::without_numbers(log.to_text()));
}

// Whether one of the entries is this line of text.
inline bool has_entry(const ScheduleLog& log, const std::string& line) {
  const ScheduleLog wanted = ScheduleLog::parse(line);
  return std::ranges::find(log.entries, wanted.entries.at(0)) != log.entries.end();
}

// Whether `holds(entry, directive)` for one of the directives of this kind.
template <class Directive, class Holds>
bool any_directive(const ScheduleLog& log, const Holds& holds) {
  return std::ranges::any_of(log.entries, [&](const ScheduleLog::Entry& entry) {
    const auto* directive = std::get_if<Directive>(&entry.directive);
    return directive && holds(entry, *directive);
  });
}

// Whether there is a directive of this kind.
template <class Directive>
bool any_directive(const ScheduleLog& log) {
  return any_directive<Directive>(log, [](const auto&, const Directive&) { return true; });
}

}  // namespace retrograde
