// zero_reasons.h -- explains why no derivative reaches an input: its consumers, and the operation that blocks each
// path.
//
//   f(x) = floor(a(x)) + b(index(x))    a: "f" reads it in floor, whose derivative is 0
//                                       index: "f" reads it in an index of "b"
#pragma once

#include <string>
#include <vector>

#include "graph/function.h"
#include "ir/visit.h"

namespace retrograde::autodiff {

// One clause for each consumer, at most a few: "\"f\" reads it in floor, whose derivative is 0". `order` is the graph;
// `has_adjoint` tells whether a Func of it has a nonzero adjoint.
std::vector<std::string> zero_reasons(const Symbol* input, const std::vector<FuncPtr>& order,
                                      FunctionRef<bool(const FuncContents&)> has_adjoint);

}  // namespace retrograde::autodiff
