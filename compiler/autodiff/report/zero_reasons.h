// zero_reasons -- why no derivative reaches an input: who reads it, and what stands in between.
//
//   f(x) = floor(a(x)) + b(index(x))    a: "f" reads it in floor, whose derivative is 0
//                                       index: "f" reads it in the place where "b" is read
#pragma once

#include <string>
#include <vector>

#include "graph/function.h"
#include "ir/visit.h"

namespace retrograde::autodiff {

// One clause a reader, at most a few: "\"f\" reads it in floor, whose derivative is 0". `order`:
// the graph; has_adjoint: whether something other than zero reaches a Func of it.
std::vector<std::string> zero_reasons(const Symbol* input, const std::vector<FuncPtr>& order,
                                      FunctionRef<bool(const FuncContents&)> has_adjoint);

}  // namespace retrograde::autodiff
