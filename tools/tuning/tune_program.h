// tune_program.h -- measures the schedules that the search finds for a program, in order of predicted time.
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include "database.h"

namespace retrograde::tune {

struct Options {
  double seconds = 60;       // for each program; afterwards no new schedule is started
  double run_seconds = 0.5;  // for each schedule
  int limit = 0;             // number of schedules to measure now, per program; 0: no limit
  int threads = 0;           // 0: all
  std::string output;        // folder for the best schedules; empty: none are written
};
// The machine's number of threads if the options name none.
int threads_of(const Options& options);

// `text`: a graph (graph/graph.h). Schedules that are in the database are not measured again. The default schedule comes
// first; the others follow by predicted time. Reports each on `out`.
void tune_program(const std::string& name, const std::string& text, const Options& options,
                  Database& database, std::ostream& out);

}  // namespace retrograde::tune
