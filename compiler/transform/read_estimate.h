// How often a stage reads one element of a Func that it calls, on average: what storing the element
// is weighed against.
#pragma once

#include "graph/function.h"

namespace retrograde::transform {

// `reader` has the stage. A guess where data decide the place, or extents are known at run time
// only.
double reads_an_element(const Call& call, const FuncContents& reader, const Definition& stage);

}  // namespace retrograde::transform
