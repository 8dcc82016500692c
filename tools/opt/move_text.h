// move_text.h -- the plans that a move gives, as text, which tools/opt prints and the golden tests compare.
//
//   func f(x, y) float32 ...     the text of a graph
//   output f
//   move f                       the Func whose loops move; `move f device`: in a program for a GPU
//   f  root  y, x                its plan; without one, that of the graph's directives
#pragma once

#include <string>

#include "autoschedule/machine/reference.h"
#include "graph/graph.h"

namespace retrograde::opt {

struct MoveText {
  std::string graph, func, plan;
  bool on_device = false;
};
// Without a line "move", all of it is the graph.
MoveText split_move(const std::string& text);

// One plan after the other, with an empty line between; the first line says so if there are none. UserError if there is no
// such move or Func. `threads`: those of the machine, which is the reference machine otherwise.
std::string plans_after(const std::string& move, const MoveText& text,
                        const std::vector<graph::FuncPtr>& outputs,
                        int threads = planning::reference_threads);

}  // namespace retrograde::opt
