// numbering.h -- refuses gradients whose slots or iterations exceed 32-bit numbers.
//
// Slots of tapes, states and iterations have 32-bit numbers. An excess that is certain is reported when the gradient is
// built, before anything is allocated.
#pragma once

#include <string>
#include <vector>

#include "autodiff/updates/update_context.h"

namespace retrograde::autodiff {

// A lower bound of the product of extents: an extent that is known at run time only counts as one.
double least_product(const std::vector<Expr>& extents);
double least_iterations(const std::vector<ReductionVariable>& loops);

// Throws Unsupported, with advice, if `count` of `what` exceeds 32-bit numbers.
void check_numbers(const UpdateContext& context, double count, const std::string& what);

}  // namespace retrograde::autodiff
