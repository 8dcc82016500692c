// schedule_log.h -- the schedule of a program as the directives that were given, in their order.
//
//   blur.in(blur_in_out, out)
//   blur.compute_at(loop(out, y, 0))
//   blur.update(0).split(r.x, ro, ri, 8, Auto)
//   out.run(y, Parallel)
//   out.specialize((n:int32 == 64))
//   out.specialization(0).run(x, Unrolled)
//
// Applied to the same program without a schedule, a log gives the same schedule. Numbers that a
// process puts behind names do not count there: where there is no blur$3, it is the one Func that
// is called blur, or blur$8; and of the Funcs that differ by their numbers alone, when the log names
// as many as there are, the first is the first.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "graph/function.h"

namespace retrograde {

class ScheduleLog {
 public:
  struct Entry {
    std::string func;               // whose schedule
    int stage = -1;                 // -1: of the Func as a whole
    std::vector<int> special = {};  // of the stage's specializations: which, and of that one which
    graph::Directive directive;
    bool operator==(const Entry& other) const;
  };
  std::vector<Entry> entries;
  // For to_cpp(), where the name does not say it: the places of reduction variables in their domains
  // and of numbered variables among those of their Funcs. Not part of the text.
  std::map<std::string, size_t> places = {};

  // Requires: every line is a directive of a Func.
  static ScheduleLog parse(const std::string& text);
  std::string to_text() const;
  // Statements that give it, in a program whose Funcs, images and Params are called like here.
  std::string to_cpp() const;

  size_t size() const { return entries.size(); }
  ScheduleLog first(size_t count) const;          // the beginning of it
  ScheduleLog of(const std::string& func) const;  // what is said of one Func
  // The same without one directive and what names a Func, a loop or a specialization that it makes;
  // the outer loop of a split is then the loop that was split.
  ScheduleLog without(size_t index) const;
  bool operator==(const ScheduleLog& other) const { return entries == other.entries; }
};

namespace graph {

// What was given to the Funcs of this graph.
ScheduleLog schedule_log(const std::vector<FuncPtr>& outputs);
// Gives all of it to the Funcs of this graph.
void apply_log(const ScheduleLog& log, const std::vector<FuncPtr>& outputs);
// A pass from graph to graph: a copy of it with all of that given.
std::vector<FuncPtr> with_log(const ScheduleLog& log, const std::vector<FuncPtr>& outputs);

}  // namespace graph
}  // namespace retrograde
