// How often a stage reads one element of a Func that it calls, on average: what storing the element
// is weighed against.
#pragma once

#include <functional>
#include <vector>

#include "graph/function.h"

namespace retrograde::autoschedule {

// `reader` has the stage. A guess where data decide the place, or extents are known at run time
// only.
// `copied`: dimensions of the reader along which its body is unrolled, so that copies share what they read.
double reads_an_element(const Call& call, const FuncContents& reader, const Definition& stage,
                        const std::vector<size_t>& copied = {});

// An index, or the terms of one, without markers and without clamps to what does not move.
Expr unclamped(const Expr& e, const std::function<bool(const Expr&)>& moves);

}  // namespace retrograde::autoschedule
