// loaded_program.h -- a program that a benchmark's run left as text.
#pragma once

#include <string>
#include <vector>

#include "graph/graph.h"

namespace bench::plans {

using retrograde::graph::FuncPtr;

// A program from its text. Expressions do not keep the parameters that they read: the graph does.
struct LoadedProgram {
  retrograde::graph::Graph graph;
  // As scheduling finds them: wrappers are applied and, in gradients, definitions have the forms that scheduling
  // expects.
  std::vector<FuncPtr> outputs;
};
// Inputs are bound to the values that driver/keep_graph.h kept with the graph, and else to made-up ones.
// Requires: the text of a graph (graph/graph.h).
LoadedProgram load_program(const std::string& text, const std::string& values = "");

}  // namespace bench::plans
