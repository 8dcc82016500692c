// schedule_log.h -- the schedule of a program as a log of its directives, in order.
//
//   blur.in(blur_in_out, out)
//   blur.compute_at(loop(out, y, 0))
//   blur.update(0).split(r.x, ro, ri, 8, Auto)
//   out.run(y, Parallel)
//   out.specialize((n:int32 == 64))
//   out.specialization(0).run(x, Unrolled)
//
// Applied to the same program without a schedule, a log gives the same schedule. The numbers that
// make names unique in a process need not match: blur$3 also means the one Func called blur or
// blur$8. Several Funcs that differ only by their numbers are matched in order, if the log and the
// program have the same count.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "graph/function.h"

namespace retrograde {

class ScheduleLog {
 public:
  struct Entry {
    std::string func;               // the scheduled Func
    int stage = -1;                 // -1: of the Func as a whole
    std::vector<int> special = {};  // path to a nested specialization: an index for each level
    graph::Directive directive;
    bool operator==(const Entry& other) const;
  };
  std::vector<Entry> entries;
  // For to_cpp(), where the name does not tell: the positions of reduction variables in their
  // domains, and of numbered variables among those of their Funcs. Not part of the text. Reduction variables whose names
  // have no dot, as adjoints have, have one before the name here.
  std::map<std::string, size_t> places = {};

  // Requires: every line is a directive of a Func.
  static ScheduleLog parse(const std::string& text);
  std::string to_text() const;
  // C++ statements that build this schedule, for a program whose Funcs, images and Params have
  // these names.
  std::string to_cpp() const;

  size_t size() const { return entries.size(); }
  ScheduleLog first(size_t count) const;          // the first `count` entries
  ScheduleLog of(const std::string& func) const;  // the entries of one Func
  // Removes one directive, and every mention of a Func, loop or specialization that it creates. The
  // outer loop of a removed split is replaced by the loop that was split.
  ScheduleLog without(size_t index) const;
  bool operator==(const ScheduleLog& other) const { return entries == other.entries; }
};

namespace graph {

// The directives of all Funcs in this graph.
ScheduleLog schedule_log(const std::vector<FuncPtr>& outputs);
// Applies the log to the Funcs of this graph.
void apply_log(const ScheduleLog& log, const std::vector<FuncPtr>& outputs);
// A pass from graph to graph: returns a copy to which the log is applied.
std::vector<FuncPtr> with_log(const ScheduleLog& log, const std::vector<FuncPtr>& outputs);

}  // namespace graph
}  // namespace retrograde
