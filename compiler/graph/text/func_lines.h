// func_lines.h -- reads the lines of a Func about its provenance and its C function.
#pragma once

#include "graph/text/declarations.h"

namespace retrograde::graph {

// Each returns false if the line is of another kind.
bool reads_provenance(const Line& line, const Declarations& declared, const FuncPtr& f);
bool reads_extern(const Line& line, const Declarations& declared, const FuncPtr& f);

}  // namespace retrograde::graph
