// A statement under construction, from the innermost body up to the root, with the regions that it needs from outside.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "lower/nests/build_loop_nests.h"
#include "lower/nests/stage_nest.h"

namespace retrograde::lower {

// Whether the loops of a nest, as far as they are built, run beyond the domains of their stages, and whether the values
// computed there matter.
struct Overrun {
  bool leaves_domain = false;
  bool counts = false;                    // a wrong value beyond a domain could do harm
  std::vector<const LoopedFunc*> inside;  // Funcs computed in these loops, consumers first
  void add(const Overrun& other);
};

// Boxes that a statement reads, and boxes of the Funcs computed in it. They mention names bound outside of the
// statement. For `unranged` loops the boxes have yet to be extended over the loop's range.
struct Needs {
  Requirements uses;
  std::map<std::string, Box> storage;  // Funcs computed inside but stored further out
  std::vector<Loop> unranged;
  // Accesses of a Func beyond its required region: storage must exist there, but the values do not matter.
  std::map<std::string, Box> touched;
  Overrun overrun;
};

// The needs of one of several stages that share loops (compute_with), while the loops around are still shared.
struct Strand : Needs {
  // The shared loops as the stage would have them alone, outermost first, and their variables in terms of those of the
  // loops that run.
  std::vector<Loop> loops;
  std::vector<Expr> at;
};

struct Emitted : Needs {
  Stmt stmt;
  int lead = 0;            // iterations of the loop around that run before its first (warm-up)
  bool has_loops = false;  // loops that are neither unrolled nor vectorized
  bool has_vectors = false;
  std::vector<Strand> strands;  // needs kept apart from its own, see shared_loops.h
};

void map_boxes(Needs& needs, const std::function<Box(const Box&)>& map);

// The union of the boxes over all iterations of the loops.
Box ranged_over(const std::vector<Loop>& loops, Box box);
// Extends every box over the loops wrapped around the statement since the last call.
void range_over_loops(Needs& needs);

void merge_needs(Needs& into, const Needs& from);
// Merges everything except the statement.
void merge_code(Emitted& into, const Emitted& from);
// Wraps a loop around the statement and all of its strands.
void wrap(const Loop& loop, Emitted& code);

Box simplified(Box box);

}  // namespace retrograde::lower
