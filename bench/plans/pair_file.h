// pair_file.h -- two plans of one program, of which one is known to be faster: a text that tests of cost models read.
//
//   program  kernels-bilateral_grid
//   fast     7.8 ms
//   slow     16.6 ms
//   wrong    predict        models that order the plans wrongly
//   # a comment
//   === fast graph
//   ...                     text of the graph (graph/graph.h) without directives
//   === fast plan
//   ...                     text of the plan (autoschedule/plan/plan.h)
//   === slow graph          left out where it is that of the fast plan
//   === slow plan
#pragma once

#include <set>
#include <string>

#include "plan_sample.h"

namespace bench::plans {

struct PlanPair {
  std::string program;
  double fast_seconds = 0, slow_seconds = 0;  // measured
  std::set<std::string> wrong;                // models that are known to order the plans wrongly
  planning::Plan fast, slow;
  // The graphs of a pair that was read keep the parameters that its expressions read.
  std::vector<retrograde::graph::Graph> graphs;

  double factor() const { return slow_seconds / fast_seconds; }
};

std::string to_text(const PlanPair& pair);
// Requires: a text that to_text gives.
PlanPair parse_pair(const std::string& text);

}  // namespace bench::plans
