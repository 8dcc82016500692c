// step_variables.h -- which variables of a reduction domain count steps whose points are independent of each other.
//
//   u(r.x, r.y, r.t) = (u(r.x - 1, r.y, r.t - 1) + u(r.x + 1, r.y, r.t - 1)) / 2      steps: r.t; points: r.x, r.y
//
// Independence and order are proven over index sets (graph/definitions/race_checks.h), so each point reads the
// values that it would read in the declared order, whatever the number of threads.
#pragma once

#include <string>
#include <vector>

#include "graph/function.h"

namespace retrograde::transform {

// The reduction variables of an update by the loops that they get, innermost first; each list is in the declared
// order.
struct StepVariables {
  std::vector<std::string> inside;  // of a point: all iterations of a sum, for example
  std::vector<std::string> points;  // of a step: independent of each other
  std::vector<std::string> steps;
  std::vector<std::string> apart;  // independent of each other at all steps
  std::string
      along_row;  // a point, or apart, that moves by one element along the rows of the Func; empty: none

  bool any_independent() const { return !points.empty() || !apart.empty(); }
  std::vector<std::string> order() const;
};

StepVariables step_variables(const FuncContents& f, const Definition& update);

}  // namespace retrograde::transform
