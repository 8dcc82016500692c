// kernel_limits.h -- which stages a kernel can compute: those that call nothing of the host.
//
//   f(x) = print(g(x))              the host prints
//   f(x) = a_function_of_c(x)       and calls C functions
//   f(g(x)) += 1.0f, g untraced     a kernel can
#pragma once

#include <vector>

#include "graph/function.h"

namespace retrograde::autoschedule {

// `stored`: those that are, or will be, computed at root. What else is read the stage computes itself.
bool can_be_kernel(const FuncPtr& f, int stage, const std::vector<FuncPtr>& stored);

// The block of partial sums that a stage adds up for itself (graph/definitions/provenance.h); null: none.
FuncPtr block_read_by(const Definition& stage, const std::vector<FuncPtr>& stored);

}  // namespace retrograde::autoschedule
