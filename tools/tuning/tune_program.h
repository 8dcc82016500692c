// tune_program.h -- measures the schedules that the search finds for a program, best first.
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include "database.h"

namespace retrograde::tune {

struct Options {
  double seconds = 60;       // for each program: after them no new schedule is begun
  double run_seconds = 0.5;  // that each schedule runs
  int limit = 0;             // schedules to measure now, of each program; 0: all that there are
  int threads = 0;           // 0: all
  std::string output;        // a folder for the best schedules; empty: none are written
};
// Of this machine, where none are named.
int threads_of(const Options& options);

// `text`: of a graph (graph/graph.h). Those that the database has are not measured again. The rules'
// schedule comes first; then by predicted time. Tells of each on `out`.
void tune_program(const std::string& name, const std::string& text, const Options& options,
                  Database& database, std::ostream& out);

}  // namespace retrograde::tune
