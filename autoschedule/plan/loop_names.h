// loop_names.h -- the names that `emit_plan` gives to loops. Plans have none.
#pragma once

#include <string>
#include <vector>

#include "autoschedule/plan/plan.h"

namespace retrograde::planning {

// The largest step of an iterator has its name or the one that rfactor gave it, the others have numbers: x, x_1, x_2. A fusion has the name of its
// inner loop. So loops of two stages of a Func have equal names if their iterators do and have equally many steps.
struct LoopNames {
  std::vector<std::string> loops;               // outermost first
  std::vector<std::vector<std::string>> parts;  // of each iterator, as parts_of() lists them

  std::string of(const Nest& nest, const Part& part) const;
};
LoopNames loop_names(const graph::FuncContents& f, int stage, const Nest& nest);

}  // namespace retrograde::planning
