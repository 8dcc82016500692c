// keep_graph.h -- the texts of the programs that are scheduled, for tools that look at them afterwards.
#pragma once

#include <string>
#include <vector>

#include "graph/function.h"

namespace retrograde::driver {

// Where RETROGRADE_GRAPHS names a folder, and a Func of the graph has no schedule yet: writes the text
// (graph/graph.h) to a file there, NAME-HASH.graph; images that are bound have their sizes as estimates. Values of
// scalars and small images that are bound stand in NAME-HASH.graph.values, a line each: the name, then numbers.
// Texts that cannot be written are left out: a program does not fail for being looked at.
void keep_graph(const std::string& name, const std::vector<FuncPtr>& outputs);

}  // namespace retrograde::driver
