// program_funcs.h -- the Funcs that a random schedule can name, by number: producers come first. Tells which Funcs read
// which, and for which regions the outputs are computed.
#pragma once

#include <functional>
#include <set>
#include <string>
#include <vector>

#include "graph/directives/schedule_log.h"
#include "testing/programs/program.h"

namespace retrograde::fuzz {

class ProgramFuncs {
 public:
  // The Funcs that the outputs need once the log's wrappers, clones and factored updates exist. Funcs of boundary
  // conditions and inline reductions are replaced by the Funcs that they read. Requires: the log is legal (UserError).
  ProgramFuncs(const RandomProgram& program, const ScheduleLog& log);

  int count() const { return static_cast<int>(funcs_.size()); }
  const graph::FuncContents& func(int f) const { return *funcs_[f]; }
  std::string name(int f) const;
  int stages(int f) const { return func(f).stage_count(); }
  bool is_pure(int f) const { return func(f).updates.empty(); }
  int dimensions(int f) const { return func(f).dimensions(); }
  bool is_output(int f) const;
  // The regions of an output, over all runs.
  std::vector<oracle::Region> regions_of(int f) const;

  // Calls `visit` with each Func, by its number, and each image (-1) that the stage reads. `direct`: the read is the
  // stage's own, not through an unscheduled Func. Each of those is visited once.
  using Visit = std::function<void(int f, const ir::Call& read, bool direct)>;
  void for_each_read(int f, int stage, const Visit& visit) const;
  int reads_of(int f) const;  // reads of Funcs in all stages, and one
  std::set<int> producers_of_stage(int f, int stage) const;
  std::set<int> producers_of(int f) const;
  bool depends(int f, int on) const;
  std::vector<int> direct_consumers_of(int f) const;
  std::vector<int> consumers_first() const;
  bool read_image_parameters() const;

 private:
  using Seen = std::set<const graph::FuncContents*>;
  void visit_reads(const graph::FuncContents& f, int stage, const Visit& visit, bool direct,
                   Seen& seen) const;

  const RandomProgram* program_;
  std::vector<graph::FuncPtr> outputs_, funcs_;  // as compiled
};

}  // namespace retrograde::fuzz
