// What is known of the operators that vectors are reduced by.
#pragma once

#include <optional>

#include "ir/atomic_update.h"

namespace retrograde::lower {

// x op identity == x, bit for bit; a broadcast when the type has lanes.
Expr identity_of(Kind op, Type type);
// What a store adds to its element, by such an operator and without a predicate.
std::optional<UpdateChain> find_vector_reduction(const Store& store);

}  // namespace retrograde::lower
