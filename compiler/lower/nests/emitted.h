// A statement on its way from an innermost body up to the root, with what it needs from outside.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "lower/nests/build_loop_nests.h"
#include "lower/nests/stage_nest.h"

namespace retrograde::lower {

// Of the loops of a nest as far as they are built: whether they run beyond the domains of their
// stages, and whether the values that are computed there count.
struct Overrun {
  bool leaves_domain = false;
  bool counts = false;                    // some value beyond a domain could do harm
  std::vector<const LoopedFunc*> inside;  // Funcs computed in these loops, consumers first
  void add(const Overrun& other);
};

// Boxes of what a statement reads and of what is computed in it. They speak of names that are bound
// outside the statement, except for `unranged` loops, over which they are still to be extended.
struct Needs {
  Requirements uses;
  std::map<std::string, Box> storage;  // Funcs computed inside but stored further out
  std::vector<Loop> unranged;
  // What is read of a Func beyond what is needed of it: there must be storage, the values are of no
  // matter.
  std::map<std::string, Box> touched;
  Overrun overrun;
};

// What one of several stages that share loops needs, while the loops around are still shared.
struct Strand : Needs {
  // The shared loops as the stage would have them alone, outermost first, and what their variables
  // are in terms of those of the loops that run.
  std::vector<Loop> loops;
  std::vector<Expr> at;
};

struct Emitted : Needs {
  Stmt stmt;
  int lead = 0;            // iterations of the loop around that run before its first
  bool has_loops = false;  // that stay loops
  bool has_vectors = false;
  std::vector<Strand> strands;  // needs apart from its own, see shared_loops.h
};

void map_boxes(Needs& needs, const std::function<Box(const Box&)>& map);

// What the box covers while the loops run.
Box ranged_over(const std::vector<Loop>& loops, Box box);
// Extends every box over the loops that were wrapped around the statement since the last call.
void range_over_loops(Needs& needs);

void merge_needs(Needs& into, const Needs& from);
// All that `from` needs; the statement stays.
void merge_code(Emitted& into, const Emitted& from);
// A loop around the statement, and around all of its strands.
void wrap(const Loop& loop, Emitted& code);

Box simplified(Box box);

}  // namespace retrograde::lower
