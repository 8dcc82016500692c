// parameter_lines.h -- reads the lines below an image, a buffer, a parameter or an output.
#pragma once

#include "graph/text/declarations.h"

namespace retrograde::graph {

// Each returns false if the line is of another kind.
bool reads_parameter(const Line& line, const Declarations& declared, ParameterContents& p);
bool reads_constraint(const Line& line, const Declarations& declared, ParameterContents& p);

}  // namespace retrograde::graph
