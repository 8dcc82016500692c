// Slots of tapes, states and iterations have 32-bit numbers. What certainly needs more is refused
// when the gradient is made, before anything is allocated.
#pragma once

#include <string>
#include <vector>

#include "autodiff/updates/update_context.h"

namespace retrograde::autodiff {

// The product of extents, those that are known at run time only counting as one: a lower bound.
double least_product(const std::vector<Expr>& extents);
double least_iterations(const std::vector<ReductionVariable>& loops);

// Throws Unsupported, with advice, where `count` of `what` have no 32-bit numbers.
void check_numbers(const UpdateContext& context, double count, const std::string& what);

}  // namespace retrograde::autodiff
