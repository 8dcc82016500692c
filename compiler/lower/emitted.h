// A statement on its way from an innermost body up to the root, with what it needs from outside.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "lower/build_loop_nests.h"
#include "lower/stage_nest.h"

namespace retrograde::ir {

// All boxes speak of names that are bound outside the statement, except for `unranged` loops, over
// which they are still to be extended.
struct Emitted {
  Stmt stmt;
  Requirements uses;
  std::map<std::string, Box> storage;  // Funcs computed inside but stored further out
  std::vector<Loop> unranged;
  int lead = 0;            // iterations of the loop around that run before its first
  bool has_loops = false;  // that stay loops
  bool has_vectors = false;
};

void map_boxes(Emitted& code, const std::function<Box(const Box&)>& map);

// What the box covers while the loops run.
Box ranged_over(const std::vector<Loop>& loops, Box box);
// Extends every box over the loops that were wrapped around the statement since the last call.
void range_over_loops(Emitted& code);

// All that `from` needs; the statement stays.
void merge_code(Emitted& into, const Emitted& from);
void wrap(const Loop& loop, Emitted& code);

Box simplified(Box box);

}  // namespace retrograde::ir
